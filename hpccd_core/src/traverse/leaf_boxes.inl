// SPDX-License-Identifier: Apache-2.0
// Features of a leaf beside a box: of which corners lie beyond it, and on which of its sides (outcodes, Cohen and
// Sutherland), follows which features do: those all of whose corners lie beyond one side. Sixteen corners are compared
// at a time, and boxes of the features beside it are never made. Part of leaf_pairs.inl and leaf_edge_faces.inl.

HPCCD_HD constexpr std::uint32_t low(std::uint32_t end, std::uint32_t axis) {
  return bound_number(end, Side::low, axis);
}
HPCCD_HD constexpr std::uint32_t high(std::uint32_t end, std::uint32_t axis) {
  return bound_number(end, Side::high, axis);
}

// Rows of corners that are compared: by number 3 * end + axis.
using CornerRows = Floats16[Tree::coordinates];

// A box to compare with: its bounds, in the order of bound_number, each `stride` numbers behind the one before.
template <std::uint32_t stride>
struct Bounds {
  const float* at;
  HPCCD_HD float operator[](std::uint32_t row) const { return at[row * stride]; }
};
HPCCD_HD Bounds<1> bounds_of(const Node& node) { return {node.box.t0.low}; }

// The box of one feature.
struct FeatureBox {
  float at[n_bounds];
  HPCCD_HD float operator[](std::uint32_t row) const { return at[row]; }
};

// What it means to lie beyond a box, below or above it along each axis. Through the whole motion (MotionBox::overlaps):
struct BothEnds {
  static constexpr bool grows = false;  // whether corners become boxes when they are loaded
  static constexpr std::uint32_t sets = 1;  // of six sides
  HPCCD_HD void grow(CornerRows&, CornerRows&) const {}
  template <class Box>
  HPCCD_HD Box bounds(const Box& b) const {
    return b;
  }
  template <class Box>
  HPCCD_HD void sides(const CornerRows& lows, const CornerRows& highs, const Box& b, Mask16 (&beyond)[6 * sets]) const {
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      beyond[axis] = less(highs[axis], all16(b[low(0, axis)])) & less(highs[3 + axis], all16(b[low(1, axis)]));
      beyond[3 + axis] = less(all16(b[high(0, axis)]), lows[axis]) & less(all16(b[high(1, axis)]), lows[3 + axis]);
    }
  }
};

// Up to a time (Node::overlap_until): in place of the second end boxes are those of that time, of which the corners'
// grow once.
struct Until {
  static constexpr bool grows = true;
  static constexpr std::uint32_t sets = 1;
  float time;
  HPCCD_HD void grow(CornerRows& lows, CornerRows& highs) const {
    const Floats16 t = all16(time);
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      lows[3 + axis] = lows[axis] + t * (lows[3 + axis] - lows[axis]) + all16(-between_ends);
      highs[3 + axis] = highs[axis] + t * (highs[3 + axis] - highs[axis]) + all16(between_ends);
    }
  }
  template <class Box>
  HPCCD_HD FeatureBox bounds(const Box& b) const {
    FeatureBox at;
    for (std::uint32_t i = 0; i < n_bounds / 2; ++i) {
      at.at[i] = b[i];
      at.at[i + n_bounds / 2] = b[i] + time * (b[i + n_bounds / 2] - b[i]);
    }
    return at;
  }
  template <class Box>
  HPCCD_HD void sides(const CornerRows& lows, const CornerRows& highs, const Box& b, Mask16 (&beyond)[6]) const {
    BothEnds().sides(lows, highs, b, beyond);
  }
};

// At the start, where boxes may also be as far apart as `reach` (Node::near_at_start).
struct AtStart {
  static constexpr bool grows = true;
  static constexpr std::uint32_t sets = 1;
  float reach;
  HPCCD_HD void grow(CornerRows& lows, CornerRows& highs) const {
    for (std::uint32_t axis = 0; axis < 3; ++axis)
      lows[axis] = lows[axis] + all16(-reach), highs[axis] = highs[axis] + all16(reach);
  }
  template <class Box>
  HPCCD_HD Box bounds(const Box& b) const {
    return b;
  }
  template <class Box>
  HPCCD_HD void sides(const CornerRows& lows, const CornerRows& highs, const Box& b, Mask16 (&beyond)[6]) const {
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      beyond[axis] = less(highs[axis], all16(b[low(0, axis)]));
      beyond[3 + axis] = less(all16(b[high(0, axis)]), lows[axis]);
    }
  }
};

// In one snapshot, where boxes may also be as far apart as `reach` (Node::near_in_snapshot): along the axes and along
// the slanted directions.
struct InSnapshot {
  static constexpr bool grows = true;
  static constexpr std::uint32_t sets = 2;
  float reach;
  HPCCD_HD void grow(CornerRows& lows, CornerRows& highs) const {
    for (std::uint32_t row = 0; row < Tree::coordinates; ++row) {
      const float by = row < 3 ? reach : slanted_reach(reach);
      lows[row] = lows[row] + all16(-by), highs[row] = highs[row] + all16(by);
    }
  }
  template <class Box>
  HPCCD_HD Box bounds(const Box& b) const {
    return b;
  }
  template <class Box>
  HPCCD_HD void sides(const CornerRows& lows, const CornerRows& highs, const Box& b, Mask16 (&beyond)[12]) const {
    for (std::uint32_t end = 0; end < 2; ++end)
      for (std::uint32_t axis = 0; axis < 3; ++axis) {
        beyond[6 * end + axis] = less(highs[3 * end + axis], all16(b[low(end, axis)]));
        beyond[6 * end + 3 + axis] = less(all16(b[high(end, axis)]), lows[3 * end + axis]);
      }
  }
};

// A leaf's features. Plain pointers: methods of std::vector compiled here could be linked into code for older processors.
struct LeafFeatures {
  const CornerRow* rows;
  const CornersOf* corners_of;
  const std::uint32_t *corners, *edges, *faces;  // numbers
  std::uint32_t n_edges, n_faces, n_vertices;
  bool many;  // more than one group of rows

  HPCCD_HD LeafFeatures(const Tree& tree, const LeafRange& leaf)
      : rows(tree.rows_of(leaf)),
        corners_of(tree.corners_of.data() + (&leaf - tree.leaves.data())),
        corners(tree.corners.data() + leaf.first_corner),
        edges(tree.edge_of_slot.data() + leaf.first_edge),
        faces(tree.face_of_slot.data() + leaf.first_face),
        n_edges(leaf.n_edges()),
        n_faces(leaf.n_faces()),
        n_vertices(leaf.n_vertices()),
        many(leaf.n_groups() > 1) {}
};

HPCCD_HD constexpr std::uint32_t first_bits(std::uint32_t n) { return n >= 32 ? ~0u : (1u << n) - 1; }

// How a leaf is read: with one or two groups of corners, whose boxes have grown or not (Tree::grown).
template <class When, bool many, bool grown>
struct Leaves {
  static constexpr std::uint32_t groups = many ? 2 : 1, sides = grown || When::grows ? 2 : 1;
  static constexpr std::uint32_t high_rows = grown ? Tree::coordinates : 0, next_group = high_rows + Tree::coordinates;

  // Its corners in lanes.
  struct Lanes {
    CornerRows at[groups][sides];
    HPCCD_HD Lanes(When when, const LeafFeatures& leaf) {
      for (std::uint32_t g = 0; g < groups; ++g) {
        const CornerRow* rows = leaf.rows + g * next_group;
        for (std::uint32_t s = 0; s < sides; ++s)
          for (std::uint32_t row = 0; row < Tree::coordinates; ++row)
            at[g][s][row] = load16(rows[row + s * high_rows].lane);
        if constexpr (When::grows) when.grow(at[g][0], at[g][1]);
      }
    }
  };

  // On which sides of a box they lie.
  struct Outcodes {
    Bytes16 of[When::sets][groups];

    template <class Box>
    HPCCD_HD Outcodes(When when, const Lanes& lanes, const Box& box) {
      for (std::uint32_t g = 0; g < groups; ++g) {
        Mask16 beyond[6 * When::sets];
        when.sides(lanes.at[g][0], lanes.at[g][sides - 1], when.bounds(box), beyond);
        for (std::uint32_t s = 0; s < When::sets; ++s) of[s][g] = bits_to_bytes(beyond + 6 * s);
      }
    }
    // Bit j: feature j of sixteen, whose corners stand in `which`, lies beyond no side.
    template <std::uint32_t n>
    HPCCD_HD unsigned near16(const std::uint8_t* const (&which)[n]) const {
      Bytes16 beyond;
      for (std::uint32_t s = 0; s < When::sets; ++s) {
        Bytes16 all = corner_bytes(of[s], which[0]);
        for (std::uint32_t j = 1; j < n; ++j) all = all & corner_bytes(of[s], which[j]);
        beyond = s == 0 ? all : beyond | all;
      }
      return zeros(beyond);
    }
    HPCCD_HD unsigned edges(const LeafFeatures& leaf) const {
      const auto& end = leaf.corners_of->edge;
      unsigned m = near16<2>({end[0], end[1]});
      if (leaf.n_edges > 16) m |= near16<2>({end[0] + 16, end[1] + 16}) << 16;
      return m & first_bits(leaf.n_edges);
    }
    HPCCD_HD unsigned faces(const LeafFeatures& leaf) const {
      const auto& corner = leaf.corners_of->face;
      return near16<3>({corner[0], corner[1], corner[2]}) & first_bits(leaf.n_faces);
    }
    HPCCD_HD unsigned vertices(const LeafFeatures& leaf) const {
      unsigned m = 0;
      for (std::uint32_t g = 0; g < groups; ++g) {
        Bytes16 beyond = of[0][g];
        if constexpr (When::sets > 1) beyond = beyond | of[1][g];
        m |= zeros(beyond) << (16 * g);
      }
      return m & first_bits(leaf.n_vertices);
    }
  };

  HPCCD_HD static Bytes16 corner_bytes(const Bytes16 (&of)[groups], const std::uint8_t* which) {
    if constexpr (many)
      return picked(of[0], of[1], load_bytes(which));
    else
      return picked(of[0], load_bytes(which));
  }

  // Which corners are one of these vertices, a byte each; false: none.
  struct Shared {
    Bytes16 of[groups];
    bool any = false;
    template <class... Vertex>
    HPCCD_HD Shared(const LeafFeatures& leaf, Vertex... v) {
      unsigned bits[groups], all = 0;
      for (std::uint32_t g = 0; g < groups; ++g) all |= bits[g] = (equal16(leaf.corners + 16 * g, v) | ...);
      if (!(any = all != 0)) return;
      for (std::uint32_t g = 0; g < groups; ++g) of[g] = to_bytes(bits[g]);
    }
    template <std::uint32_t n>
    HPCCD_HD unsigned none16(const std::uint8_t* const (&which)[n]) const {
      Bytes16 one = corner_bytes(of, which[0]);
      for (std::uint32_t j = 1; j < n; ++j) one = one | corner_bytes(of, which[j]);
      return zeros(one);
    }
    HPCCD_HD unsigned edges_without(const LeafFeatures& leaf) const {
      const auto& end = leaf.corners_of->edge;
      const unsigned m = none16<2>({end[0], end[1]});
      return leaf.n_edges > 16 ? m | none16<2>({end[0] + 16, end[1] + 16}) << 16 : m;
    }
    HPCCD_HD unsigned faces_without(const LeafFeatures& leaf) const {
      const auto& corner = leaf.corners_of->face;
      return none16<3>({corner[0], corner[1], corner[2]});
    }
  };

  // The box of one corner, where it lies.
  struct CornerBox {
    const CornerRow* rows;
    std::uint32_t lane;
    HPCCD_HD const float& row_of(std::uint32_t bound) const {
      const std::uint32_t row = bound / 6 * 3 + bound % 3;
      return rows[side_of_bound(bound) == Side::low ? row : row + high_rows].lane[lane];
    }
    HPCCD_HD float operator[](std::uint32_t bound) const { return row_of(bound); }
  };
  HPCCD_HD static Floats16 picked_of(const float* row, Picks16 p) {
    if constexpr (many)
      return picked(row, row + next_group * CornerRow::width, p);
    else
      return picked(row, p);
  }
  HPCCD_HD static CornerBox box_of(const LeafFeatures& leaf, std::uint32_t corner) {
    if constexpr (many) return {leaf.rows + corner / 16 * next_group, corner % 16};
    return {leaf.rows, corner};
  }
  template <class... Boxes>
  HPCCD_HD static FeatureBox joined(const Boxes&... of) {
    FeatureBox box;
    for (std::uint32_t i = 0; i < n_bounds; ++i) {
      const bool is_low = side_of_bound(i) == Side::low;
      float x = is_low ? INFINITY : -INFINITY;
      ((x = is_low ? lesser(of[i], x) : greater(of[i], x)), ...);
      box.at[i] = x;
    }
    return box;
  }
  HPCCD_HD static FeatureBox face_box(const LeafFeatures& leaf, std::uint32_t k) {
    const auto& corner = leaf.corners_of->face;
    return joined(box_of(leaf, corner[0][k]), box_of(leaf, corner[1][k]), box_of(leaf, corner[2][k]));
  }
};

// The boxes of a leaf's edges: where lanes can be picked at once all of them, else one by one.
template <class Kernel>
class EdgeBoxes {
 public:
  HPCCD_HD explicit EdgeBoxes(const LeafFeatures& leaf) : leaf_(leaf) {
    if constexpr (picks_at_once)
      for (std::uint32_t i = 0; i < leaf.n_edges; i += 16) join(i);
  }
  HPCCD_HD auto operator[](std::uint32_t k) const {
    if constexpr (picks_at_once) {
      return Bounds<CornersOf::most_edges>{bounds_[0] + k};
    } else {
      const auto& end = leaf_.corners_of->edge;
      return Kernel::joined(Kernel::box_of(leaf_, end[0][k]), Kernel::box_of(leaf_, end[1][k]));
    }
  }

 private:
  HPCCD_HD void join(std::uint32_t i) {
    const auto& end = leaf_.corners_of->edge;
    const Picks16 first = picks(end[0] + i), second = picks(end[1] + i);
    for (std::uint32_t bound = 0; bound < n_bounds; ++bound) {
      const float* row = &Kernel::box_of(leaf_, 0).row_of(bound);
      const Floats16 a = Kernel::picked_of(row, first), b = Kernel::picked_of(row, second);
      store16(bounds_[bound] + i, side_of_bound(bound) == Side::low ? min(a, b) : max(a, b));
    }
  }

  const LeafFeatures& leaf_;
  alignas(64) float bounds_[picks_at_once ? n_bounds : 1][CornersOf::most_edges];
};

// Appends the pairs of `number` with those of the features from `others` on that are in m.
template <bool ascending>
HPCCD_HD void append(CandidateBuffer& out, std::uint32_t number, const std::uint32_t* others, unsigned m) {
  append_pairs<ascending>(out.first, out.second, out.n, number, others, m & 0xFFFF);
  if (m >> 16) append_pairs<ascending>(out.first, out.second, out.n, number, others + 16, m >> 16);
}

// f(number) for each bit.
template <class Function>
HPCCD_HD void for_each(unsigned bits, Function&& f) {
  for (; bits; bits &= bits - 1) f(static_cast<std::uint32_t>(__builtin_ctz(bits)));
}

// Calls f with how each of them is to be read.
template <class When, class Function>
HPCCD_HD void with_kernels(const Tree& tree, const LeafFeatures& a, const LeafFeatures& b, Function&& f) {
  const auto with = [&](auto grown) {
    using One = Leaves<When, false, decltype(grown)::value>;
    using Many = Leaves<When, true, decltype(grown)::value>;
    if (a.many)
      b.many ? f(Many(), Many()) : f(Many(), One());
    else
      b.many ? f(One(), Many()) : f(One(), One());
  };
  tree.grown ? with(std::true_type()) : with(std::false_type());
}
