// SPDX-License-Identifier: Apache-2.0
// Finds the features of a leaf that lie beyond one side of a box. Outcodes (Cohen and Sutherland) say which corners
// lie beyond which side; a feature is outside if all its corners lie beyond the same side. Sixteen corners are
// compared at a time. Boxes of features are never built: a corner lies beyond a side of the box of a feature if it lies
// beyond that side of each of the feature's corners. Part of leaf_pairs.inl and leaf_edge_faces.inl.

HPCCD_HD constexpr std::uint32_t low(std::uint32_t end, std::uint32_t axis) {
  return bound_number(end, Side::low, axis);
}
HPCCD_HD constexpr std::uint32_t high(std::uint32_t end, std::uint32_t axis) {
  return bound_number(end, Side::high, axis);
}

// Bounds of a box to compare with, in the order of bound_number, each `stride` numbers after the previous one.
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

// Some corners, as boxes: low and high bounds by 3 * end + axis. Both are the same array if boxes have not grown.
struct Corners {
  Row low[Tree::coordinates], high[Tree::coordinates];
};

// What is grown before corners are compared with boxes, once for a leaf.
enum class Grown { nothing, corners, boxes };

// When a corner lies beyond a box, below or above it along each axis. bounds(box): what corners are compared with.
// Throughout the motion (MotionBox::overlaps):
struct BothEnds {
  static constexpr Grown grown = Grown::nothing;
  static constexpr std::uint32_t sets = 1;  // six sides
  template <class Box>
  HPCCD_HD const Box& bounds(const Box& b) const {
    return b;
  }
  template <class Box>
  HPCCD_HD static void sides(const Corners& c, const Box& b, RowMask (&beyond)[6]) {
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      beyond[axis] =
          less(c.high[axis], all_lanes(b[low(0, axis)])) & less(c.high[3 + axis], all_lanes(b[low(1, axis)]));
      beyond[3 + axis] =
          less(all_lanes(b[high(0, axis)]), c.low[axis]) & less(all_lanes(b[high(1, axis)]), c.low[3 + axis]);
    }
  }
};

// Up to a time (Node::overlap_until): boxes at that time take the place of the second end; those of the corners grow
// once.
struct Until {
  static constexpr Grown grown = Grown::corners;
  static constexpr std::uint32_t sets = 1;
  float time;
  HPCCD_HD void grow(Corners& c) const {
    const Row t = all_lanes(time);
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      c.low[3 + axis] = c.low[axis] + t * (c.low[3 + axis] - c.low[axis]) + all_lanes(-between_ends);
      c.high[3 + axis] = c.high[axis] + t * (c.high[3 + axis] - c.high[axis]) + all_lanes(between_ends);
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
  HPCCD_HD static void sides(const Corners& c, const Box& b, RowMask (&beyond)[6]) {
    BothEnds::sides(c, b, beyond);
  }
};

// Throughout the motion, if boxes of two meshes have grown by more than their separation requires (traverse/excess.h):
// the boxes of the corners shrink by the excess.
struct LessExcess : BothEnds {
  static constexpr Grown grown = Grown::corners;
  static constexpr bool only_grown = true;  // boxes that have not grown have no excess
  float excess;
  HPCCD_HD void grow(Corners& c) const {
    for (std::uint32_t row = 0; row < Tree::coordinates; ++row)
      c.low[row] = c.low[row] + all_lanes(excess), c.high[row] = c.high[row] + all_lanes(-excess);
  }
};

// The box of a leaf or block, with each side moved outwards by by(side).
template <class Box, class By>
HPCCD_HD FeatureBox moved(const Box& b, By&& by) {
  FeatureBox box;
  for (std::uint32_t i = 0; i < n_bounds; ++i) box.at[i] = side_of_bound(i) == Side::low ? b[i] - by(i) : b[i] + by(i);
  return box;
}

// At the start of the motion; boxes may be up to `reach` apart (Node::near_at_start).
struct AtStart {
  static constexpr Grown grown = Grown::boxes;
  static constexpr std::uint32_t sets = 1;
  static constexpr std::uint32_t rows = 3;  // that grow
  float reach;
  HPCCD_HD float by(std::uint32_t) const { return reach; }
  template <class Box>
  HPCCD_HD FeatureBox bounds(const Box& b) const {
    return moved(b, [&](std::uint32_t) { return reach; });
  }
  template <class Box>
  HPCCD_HD static void sides(const Corners& c, const Box& b, RowMask (&beyond)[6]) {
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      beyond[axis] = less(c.high[axis], all_lanes(b[low(0, axis)]));
      beyond[3 + axis] = less(all_lanes(b[high(0, axis)]), c.low[axis]);
    }
  }
};

// In one snapshot; boxes may be up to `reach` apart (Node::near_in_snapshot), along the axes and along the slanted
// directions.
struct InSnapshot {
  static constexpr Grown grown = Grown::boxes;
  static constexpr std::uint32_t sets = 2;
  static constexpr std::uint32_t rows = Tree::coordinates;
  float reach;
  HPCCD_HD float by(std::uint32_t row) const { return row < 3 ? reach : slanted_reach(reach); }
  template <class Box>
  HPCCD_HD FeatureBox bounds(const Box& b) const {
    return moved(b, [&](std::uint32_t i) { return by(i < n_bounds / 2 ? 0 : 3); });
  }
  template <class Box>
  HPCCD_HD static void sides(const Corners& c, const Box& b, RowMask (&beyond)[12]) {
    for (std::uint32_t end = 0; end < 2; ++end)
      for (std::uint32_t axis = 0; axis < 3; ++axis) {
        beyond[6 * end + axis] = less(c.high[3 * end + axis], all_lanes(b[low(end, axis)]));
        beyond[6 * end + 3 + axis] = less(all_lanes(b[high(end, axis)]), c.low[3 * end + axis]);
      }
  }
};

// The same for boxes that must touch.
struct TouchingInSnapshot : InSnapshot {
  static constexpr Grown grown = Grown::nothing;
  template <class Box>
  HPCCD_HD const Box& bounds(const Box& b) const {
    return b;
  }
};

// A leaf's features, as plain pointers: any function of std::vector beyond data(), compiled here, could be linked into
// code for older processors.
struct LeafFeatures {
  const CornerRow* rows;
  const CornersOf* corners_of;
  const std::uint32_t *corners, *edges, *faces;  // numbers
  std::uint32_t n_edges, n_faces, n_vertices, n_corners;
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
        n_corners(leaf.n_corners()),
        many(leaf.n_groups() > 1) {}
};

HPCCD_HD constexpr std::uint32_t first_bits(std::uint32_t n) { return n >= 32 ? ~0u : (1u << n) - 1; }

// Calls f(number) for each bit that is set.
template <class Function>
HPCCD_HD void for_each(unsigned bits, Function&& f) {
  for (; bits; bits &= bits - 1) f(static_cast<std::uint32_t>(__builtin_ctz(bits)));
}

// How a leaf is read: with one or more groups of corners, with boxes that have grown or not (Tree::grown).
template <class When, bool many, bool grown>
struct Leaves {
  static constexpr std::uint32_t groups = many ? 2 : 1;
  static constexpr std::uint32_t high_rows = grown ? Tree::coordinates : 0, next_group = high_rows + Tree::coordinates;

  // The corners of a leaf, to be compared with boxes.
  struct Lanes {
    static constexpr bool own = When::grown == Grown::corners;
    static constexpr std::uint32_t high_rows = own ? Tree::coordinates : Leaves::high_rows,
                                   next_group = high_rows + Tree::coordinates;
    CornerRow grown_rows[own ? groups * next_group : 1];
    const CornerRow* rows;

    HPCCD_HD Lanes(When when, const LeafFeatures& leaf) : rows(own ? grown_rows : leaf.rows) {
      if constexpr (own)
        for (std::uint32_t g = 0; g < groups; ++g)
          for (std::uint32_t i = 0; i < 16; i += row_width) {
            Corners c = load<Leaves::high_rows>(leaf.rows + g * Leaves::next_group, i);
            when.grow(c);
            for (std::uint32_t row = 0; row < Tree::coordinates; ++row) {
              store(grown_rows[g * next_group + row].lane + i, c.low[row]);
              store(grown_rows[g * next_group + high_rows + row].lane + i, c.high[row]);
            }
          }
    }
    template <std::uint32_t high_rows>
    HPCCD_HD static Corners load(const CornerRow* rows, std::uint32_t i) {
      Corners c;
      for (std::uint32_t row = 0; row < Tree::coordinates; ++row) {
        c.low[row] = load_row(rows[row].lane + i);
        c.high[row] = high_rows ? load_row(rows[row + high_rows].lane + i) : c.low[row];
      }
      return c;
    }
    HPCCD_HD Corners at(std::uint32_t group, std::uint32_t i) const {
      return load<high_rows>(rows + group * next_group, i);
    }
  };

  // The boxes of the corners of a leaf, one by one.
  struct Boxes {
    static constexpr bool own = When::grown == Grown::boxes;
    static constexpr std::uint32_t high_rows = own ? Tree::coordinates : Leaves::high_rows,
                                   next_group = high_rows + Tree::coordinates;
    CornerRow grown_rows[own ? groups * next_group : 1];
    const CornerRow* rows;

    HPCCD_HD Boxes(When when, const LeafFeatures& leaf) : rows(own ? grown_rows : leaf.rows) {
      if constexpr (own)
        for (std::uint32_t g = 0; g < groups; ++g)
          for (std::uint32_t i = 0; i < 16; i += row_width)
            for (std::uint32_t row = 0; row < When::rows; ++row) {
              const CornerRow* from = leaf.rows + g * Leaves::next_group + row;
              CornerRow* to = grown_rows + g * next_group + row;
              store(to->lane + i, load_row(from->lane + i) + all_lanes(-when.by(row)));
              store(to[high_rows].lane + i, load_row(from[Leaves::high_rows].lane + i) + all_lanes(when.by(row)));
            }
    }
    // One box, read in place.
    struct Box {
      const CornerRow* rows;
      std::uint32_t lane;
      HPCCD_HD float operator[](std::uint32_t bound) const {
        const std::uint32_t row = bound / 6 * 3 + bound % 3;
        return rows[side_of_bound(bound) == Side::low ? row : row + high_rows].lane[lane];
      }
    };
    HPCCD_HD Box operator[](std::uint32_t corner) const {
      if constexpr (many) return {rows + corner / 16 * next_group, corner % 16};
      return {rows, corner};
    }
  };

  // On which sides of a box corners lie.
  struct Outcodes {
    Bytes16 of[When::sets][groups];

    HPCCD_HD Outcodes() {}
    template <class Box>
    HPCCD_HD Outcodes(const LeafFeatures& leaf, const Lanes& lanes, const Box& bounds) {
      for (std::uint32_t g = 0; g < groups; ++g) {
        SideBits bits[When::sets][16 / row_width] = {};
        for (std::uint32_t i = 0; i < 16 && (row_width == 16 || 16 * g + i < leaf.n_corners); i += row_width) {
          RowMask beyond[6 * When::sets];
          When::sides(lanes.at(g, i), bounds, beyond);
          for (std::uint32_t s = 0; s < When::sets; ++s) bits[s][i / row_width] = side_bits(beyond + 6 * s);
        }
        for (std::uint32_t s = 0; s < When::sets; ++s) of[s][g] = to_bytes(bits[s]);
      }
    }
    HPCCD_HD Outcodes operator&(const Outcodes& other) const {
      Outcodes both;
      for (std::uint32_t s = 0; s < When::sets; ++s)
        for (std::uint32_t g = 0; g < groups; ++g) both.of[s][g] = of[s][g] & other.of[s][g];
      return both;
    }
    // Bit j: feature j of sixteen, whose corners are numbered by `which`, has no side beyond which all its corners lie.
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
};

// Calls f with the type that describes how the leaves are read.
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
  if constexpr (requires { When::only_grown; })
    with(std::true_type());
  else
    tree.grown ? with(std::true_type()) : with(std::false_type());
}
