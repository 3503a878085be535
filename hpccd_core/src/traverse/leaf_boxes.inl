// SPDX-License-Identifier: Apache-2.0
// Boxes of a leaf's features, made from its corners and compared 16 at a time. Part of leaf_pairs.inl and
// leaf_edge_faces.inl.

HPCCD_HD constexpr std::uint32_t low(std::uint32_t end, std::uint32_t axis) {
  return bound_number(end, Side::low, axis);
}
HPCCD_HD constexpr std::uint32_t high(std::uint32_t end, std::uint32_t axis) {
  return bound_number(end, Side::high, axis);
}

// Boxes of up to 16 features of a leaf, a row for each of the twelve bounds.
struct alignas(64) BoxGroup {
  static constexpr std::uint32_t width = CornerRow::width;
  float rows[n_bounds][width];
};

// A leaf's corners. Plain pointers: methods of std::vector compiled here could be linked into code for older processors.
struct LeafCorners {
  const CornerRow* rows;
  const CornersOf* of;
  const std::uint32_t* numbers;
  bool many, grown;  // more than one group of rows; rows for low and for high bounds

  HPCCD_HD LeafCorners(const Tree& tree, const LeafRange& leaf)
      : rows(tree.rows_of(leaf)),
        of(tree.corners_of.data() + (&leaf - tree.leaves.data())),
        numbers(tree.corners.data() + leaf.first_corner),
        many(leaf.n_groups() > 1),
        grown(tree.grown) {}
};

// Boxes of 16 features, each of n corners.
template <bool many, bool grown, std::uint32_t n>
HPCCD_HD void join_corners(const CornerRow* rows, const std::uint8_t* const (&which)[n], BoxGroup& out) {
  constexpr std::uint32_t high_rows = grown ? Tree::coordinates : 0, next = high_rows + Tree::coordinates;
  Picks16 p[n];
  for (std::uint32_t j = 0; j < n; ++j) p[j] = picks(which[j]);
  const auto at = [&](std::uint32_t row, std::uint32_t j) {
    if constexpr (many) return picked(rows[row].lane, rows[row + next].lane, p[j]);
    return picked(rows[row].lane, p[j]);
  };
  for (std::uint32_t end = 0; end < 2; ++end)
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t row = 3 * end + axis;
      Floats16 least = at(row, 0), most = grown ? at(row + high_rows, 0) : least;
      for (std::uint32_t j = 1; j < n; ++j) {
        const Floats16 x = at(row, j);
        least = min(least, x), most = max(most, grown ? at(row + high_rows, j) : x);
      }
      store16(out.rows[low(end, axis)], least), store16(out.rows[high(end, axis)], most);
    }
}

template <std::uint32_t n>
HPCCD_HD void boxes_of(const LeafCorners& c, const std::uint8_t* const (&which)[n], BoxGroup& out) {
  if (c.many)
    c.grown ? join_corners<true, true>(c.rows, which, out) : join_corners<true, false>(c.rows, which, out);
  else
    c.grown ? join_corners<false, true>(c.rows, which, out) : join_corners<false, false>(c.rows, which, out);
}

struct EdgeBoxes {
  static constexpr std::uint32_t n = CornersOf::most_edges / BoxGroup::width;
  BoxGroup groups[n];
  HPCCD_HD EdgeBoxes(const LeafCorners& c, std::uint32_t n_edges) {
    for (std::uint32_t i = 0; i < n_edges; i += BoxGroup::width)
      boxes_of<2>(c, {c.of->edge[0] + i, c.of->edge[1] + i}, groups[i / BoxGroup::width]);
  }
};

struct FaceBoxes {
  BoxGroup group;
  HPCCD_HD explicit FaceBoxes(const LeafCorners& c) {
    boxes_of<3>(c, {c.of->face[0], c.of->face[1], c.of->face[2]}, group);
  }
};

// Those of all corners, of which the first ones are the leaf's vertices.
struct VertexBoxes {
  BoxGroup groups[2];
  HPCCD_HD VertexBoxes(const LeafCorners& c, std::uint32_t n_vertices) {
    const std::uint32_t high_rows = c.grown ? Tree::coordinates : 0;
    const CornerRow* rows = c.rows;
    for (std::uint32_t i = 0; i < n_vertices; i += BoxGroup::width, rows += high_rows + Tree::coordinates)
      for (std::uint32_t row = 0; row < Tree::coordinates; ++row) {
        auto& out = groups[i / BoxGroup::width].rows;
        store16(out[low(row / 3, row % 3)], load16(rows[row].lane));
        store16(out[high(row / 3, row % 3)], load16(rows[row + high_rows].lane));
      }
  }
};

// Vertex numbers of both ends of the edges, or of the three corners of the faces.
template <std::uint32_t n, std::uint32_t most>
struct alignas(64) CornerNumbers {
  std::uint32_t of[n][most];
  HPCCD_HD CornerNumbers(const LeafCorners& c, const std::uint8_t (&which)[n][most], std::uint32_t n_features) {
    for (std::uint32_t i = 0; i < n_features; i += CornerRow::width)
      for (std::uint32_t j = 0; j < n; ++j) pick(of[j] + i, c.numbers, picks(which[j] + i));
  }
};
using EdgeEnds = CornerNumbers<2, CornersOf::most_edges>;
using FaceCorners = CornerNumbers<3, CornersOf::most_faces>;

// A box to compare with: its bounds, in the order of a group's rows, each `stride` numbers behind the one before.
template <std::uint32_t stride>
struct Bounds {
  const float* at;
  HPCCD_HD float operator[](std::uint32_t row) const { return at[row * stride]; }
};

HPCCD_HD Bounds<BoxGroup::width> bounds_at(const BoxGroup* groups, std::uint32_t i) {
  return {groups[i / BoxGroup::width].rows[0] + i % BoxGroup::width};
}
HPCCD_HD Bounds<1> bounds_of(const Node& node) { return {node.box.t0.low}; }

// Bit j: box j of the group overlaps b. Through the whole motion (MotionBox::overlaps):
struct BothEnds {
  using Group = Rows16<n_bounds>;
  template <class Bounds>
  HPCCD_HD Bounds bounds(Bounds b) const {
    return b;
  }
  HPCCD_HD static Group load(const BoxGroup& group) { return load_rows(group.rows); }
  template <class Bounds>
  HPCCD_HD unsigned overlapping(const Group& g, Bounds b) const {
    Mask16 apart;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const Mask16 below = less(g[high(0, axis)], all16(b[low(0, axis)]));
      const Mask16 above = less(all16(b[high(0, axis)]), g[low(0, axis)]);
      apart = apart | (below & less(g[high(1, axis)], all16(b[low(1, axis)])));
      apart = apart | (above & less(all16(b[high(1, axis)]), g[low(1, axis)]));
    }
    return ~apart.bits() & 0xFFFF;
  }
};

// Up to a time (Node::overlap_until): in place of the second end boxes are those of that time, of which the group's
// grow once, when they are loaded.
struct Until {
  float time;
  struct Group {
    Floats16 rows[n_bounds];
  };
  struct At {
    float value[n_bounds];
    HPCCD_HD float operator[](std::uint32_t row) const { return value[row]; }
  };
  HPCCD_HD Group load(const BoxGroup& group) const {
    Group g;
    const Floats16 t = all16(time), lower = all16(-between_ends), higher = all16(between_ends);
    for (std::uint32_t i = 0; i < n_bounds / 2; ++i) {
      const Floats16 start = load16(group.rows[i]), end = load16(group.rows[i + n_bounds / 2]);
      g.rows[i] = start;
      g.rows[i + n_bounds / 2] = start + t * (end - start) + (side_of_bound(i) == Side::low ? lower : higher);
    }
    return g;
  }
  template <class Bounds>
  HPCCD_HD At bounds(Bounds b) const {
    At at;
    for (std::uint32_t i = 0; i < n_bounds / 2; ++i) {
      at.value[i] = b[i];
      at.value[i + n_bounds / 2] = b[i] + time * (b[i + n_bounds / 2] - b[i]);
    }
    return at;
  }
  template <class Bounds>
  HPCCD_HD unsigned overlapping(const Group& g, const Bounds& b) const {
    Mask16 apart;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const Mask16 below = less(g.rows[high(0, axis)], all16(b[low(0, axis)]));
      const Mask16 above = less(all16(b[high(0, axis)]), g.rows[low(0, axis)]);
      apart = apart | (below & less(g.rows[high(1, axis)], all16(b[low(1, axis)])));
      apart = apart | (above & less(all16(b[high(1, axis)]), g.rows[low(1, axis)]));
    }
    return ~apart.bits() & 0xFFFF;
  }
};

// At the start, where boxes may also be as far apart as `reach` (Node::near_at_start).
struct AtStart {
  float reach;
  struct Group {
    Floats16 rows[n_bounds / 2];
  };
  HPCCD_HD Group load(const BoxGroup& group) const {
    Group grown;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      grown.rows[low(0, axis)] = load16(group.rows[low(0, axis)]) + all16(-reach);
      grown.rows[high(0, axis)] = load16(group.rows[high(0, axis)]) + all16(reach);
    }
    return grown;
  }
  template <class Bounds>
  HPCCD_HD Bounds bounds(Bounds b) const {
    return b;
  }
  template <class Bounds>
  HPCCD_HD unsigned overlapping(const Group& g, Bounds b) const {
    Mask16 apart;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      apart = apart | less(g.rows[high(0, axis)], all16(b[low(0, axis)]));
      apart = apart | less(all16(b[high(0, axis)]), g.rows[low(0, axis)]);
    }
    return ~apart.bits() & 0xFFFF;
  }
};

// In one snapshot, where boxes may also be as far apart as `reach` (Node::near_in_snapshot): those of the group grow by
// it once, when they are loaded.
struct InSnapshot {
  float reach;
  template <class Bounds>
  HPCCD_HD Bounds bounds(Bounds b) const {
    return b;
  }
  struct Group {
    Floats16 rows[n_bounds];
  };
  HPCCD_HD Group load(const BoxGroup& group) const {
    Group grown;
    for (std::uint32_t end = 0; end < 2; ++end) {
      const float by = end == 0 ? reach : slanted_reach(reach);
      for (std::uint32_t axis = 0; axis < 3; ++axis) {
        grown.rows[low(end, axis)] = load16(group.rows[low(end, axis)]) + all16(-by);
        grown.rows[high(end, axis)] = load16(group.rows[high(end, axis)]) + all16(by);
      }
    }
    return grown;
  }
  template <class Bounds>
  HPCCD_HD unsigned overlapping(const Group& g, Bounds b) const {
    Mask16 apart;
    for (std::uint32_t end = 0; end < 2; ++end)
      for (std::uint32_t axis = 0; axis < 3; ++axis) {
        apart = apart | less(g.rows[high(end, axis)], all16(b[low(end, axis)]));
        apart = apart | less(all16(b[high(end, axis)]), g.rows[low(end, axis)]);
      }
    return ~apart.bits() & 0xFFFF;
  }
};

// The lanes of the group [i, i + 16) that lie in [begin, end).
HPCCD_HD unsigned lanes_in(std::uint32_t i, std::uint32_t begin, std::uint32_t end) {
  unsigned m = end - i >= 16 ? 0xFFFFu : (1u << (end - i)) - 1;
  if (begin > i) m &= begin - i >= 16 ? 0u : ~((1u << (begin - i)) - 1);
  return m;
}

// Appends the pairs of `number` with those of the 16 features from `others` on that are in m.
template <bool ascending>
HPCCD_HD void append(CandidateBuffer& out, std::uint32_t number, const std::uint32_t* others, unsigned m) {
  append_pairs<ascending>(out.first, out.second, out.n, number, others, m);
}

// Features of one leaf that overlap the other leaf's box: a bit each, by group.
struct Near {
  static constexpr std::uint32_t most_groups = (4 * Tree::leaf_size + BoxGroup::width - 1) / BoxGroup::width;
  unsigned lanes[most_groups] = {};
  unsigned count = 0;
};

// Of features begin to end - 1 of the groups.
template <class When>
HPCCD_HD Near near(When when, const BoxGroup* groups, std::uint32_t begin, std::uint32_t end, const Node& other) {
  Near n;
  for (std::uint32_t i = 0, group = 0; i < end; i += BoxGroup::width, ++group)
    n.lanes[group] =
        when.overlapping(when.load(groups[group]), when.bounds(bounds_of(other))) & lanes_in(i, begin, end),
    n.count += static_cast<unsigned>(__builtin_popcount(n.lanes[group]));
  return n;
}

// f(number) for each of them.
template <class Function>
HPCCD_HD void for_each(const Near& n, std::uint32_t end, Function&& f) {
  for (std::uint32_t i = 0, group = 0; i < end; i += BoxGroup::width, ++group)
    for (unsigned lanes = n.lanes[group]; lanes; lanes &= lanes - 1) f(i + static_cast<unsigned>(__builtin_ctz(lanes)));
}
