// SPDX-License-Identifier: Apache-2.0
// Comparison of two k-DOPs in lanes: eight directions at both ends of the motion. Part of kdop_filter.inl and
// leaf_pairs.inl.

struct KdopLanes {
  Floats16 low, high;
};
HPCCD_HD bool are_apart(const KdopLanes& a, const KdopLanes& b) {
  return any_in_both_halves(less(a.high, b.low), less(b.high, a.low));
}

// Separated by more than a margin in each direction up to a time below 1.
struct UntilTime {
  Floats16 margin, time;
  HPCCD_HD bool are_apart(const KdopLanes& a, const KdopLanes& b) const {
    return any_in_both_halves(less(at(a.high) + margin, at(b.low)), less(at(b.high) + margin, at(a.low)));
  }
  HPCCD_HD Floats16 at(Floats16 x) const {
    const Floats16 start = first_half_twice(x);
    return start + time * (x - start);
  }
};
// Values below eight, interpolated in floats, have errors of 1.5e-6 each.
HPCCD_HD UntilTime until(const KdopMargin& margin, float time) {
  return {load16(margin.in) + all16(4e-6f), all16(time)};
}
