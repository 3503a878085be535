// SPDX-License-Identifier: Apache-2.0
// Boxes of a leaf's features, compared 16 at a time. Part of leaf_pairs.inl and leaf_edge_faces.inl.

HPCCD_HD constexpr std::uint32_t low(std::uint32_t end, std::uint32_t axis) {
  return bound_number(end, Side::low, axis);
}
HPCCD_HD constexpr std::uint32_t high(std::uint32_t end, std::uint32_t axis) {
  return bound_number(end, Side::high, axis);
}

// A box to compare with: its bounds, in the order of a group's rows, each `stride` numbers behind the one before.
template <std::uint32_t stride>
struct Bounds {
  const float* at;
  HPCCD_HD float operator[](std::uint32_t row) const { return at[row * stride]; }
};

// Plain pointers: methods of std::vector compiled here could be linked into code for older processors.
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
