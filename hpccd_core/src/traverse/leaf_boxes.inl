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

// How a kernel reads leaves: with one or two groups of corners, whose boxes have grown or not (Tree::grown).
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

  // The box of corner, or of several.
  template <class... Corner>
  HPCCD_HD static FeatureBox box_of(const LeafFeatures& leaf, Corner... corner) {
    FeatureBox box;
    for (std::uint32_t end = 0; end < 2; ++end)
      for (std::uint32_t axis = 0; axis < 3; ++axis) {
        const auto at = [&](std::uint32_t c, std::uint32_t first_row) {
          const CornerRow* rows = leaf.rows + first_row + 3 * end + axis;
          if constexpr (many) return rows[c / 16 * next_group].lane[c % 16];
          return rows->lane[c];
        };
        float least = INFINITY, most = -INFINITY;
        ((least = lesser(at(corner, 0), least), most = greater(at(corner, high_rows), most)), ...);
        box.at[low(end, axis)] = least, box.at[high(end, axis)] = most;
      }
    return box;
  }
  HPCCD_HD static FeatureBox edge_box(const LeafFeatures& leaf, std::uint32_t k) {
    return box_of(leaf, leaf.corners_of->edge[0][k], leaf.corners_of->edge[1][k]);
  }
  HPCCD_HD static FeatureBox face_box(const LeafFeatures& leaf, std::uint32_t k) {
    const auto& corner = leaf.corners_of->face;
    return box_of(leaf, corner[0][k], corner[1][k], corner[2][k]);
  }
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

// Calls f with the Leaves that these two need.
template <class When, class Function>
HPCCD_HD void with_leaves(const Tree& tree, const LeafFeatures& a, const LeafFeatures& b, Function&& f) {
  const bool many = a.many || b.many;
  if (tree.grown)
    many ? f(Leaves<When, true, true>()) : f(Leaves<When, false, true>());
  else
    many ? f(Leaves<When, true, false>()) : f(Leaves<When, false, false>());
}
