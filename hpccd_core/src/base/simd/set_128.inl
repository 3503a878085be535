// SPDX-License-Identifier: Apache-2.0
// The interface of kernels (scalar.h) for 16-byte registers, as far as the compiler's own vectors implement it. Part
// of scalar.h and neon.h, which define bits16() before it and Bytes16 after it.

// Real numbers in lanes, with the operations of real.h: two doubles or four floats, for which every 64-bit processor
// has registers. For scalars g++ compiles `select` to branches, which are unpredictable here: the whole step of 92 K
// triangles took 1.5 times as long as with clang++.
using Double = Lanes<double, 2>;
using Single = Lanes<float, 4>;
inline constexpr int double_width = 2;

HPCCD_HD Double load2(const double* x) {
  Double::Vec v;
  __builtin_memcpy(&v, x, sizeof v);
  return Double(v);
}
// x y z and padding of two points, a row each.
HPCCD_HD Vec3<Double> transposed(const Double xy[2], const Double z[2]) {
  return {Double(__builtin_shufflevector(xy[0].v, xy[1].v, 0, 2)),
          Double(__builtin_shufflevector(xy[0].v, xy[1].v, 1, 3)),
          Double(__builtin_shufflevector(z[0].v, z[1].v, 0, 2))};
}

// A cache line of eight doubles: x y z and padding at t = 0, then at t = 1.
struct MotionRow {
  Double xy_t0, z_t0, xy_t1, z_t1;
};
HPCCD_HD MotionRow difference(const double* to, const double* from) {
  return {load2(to) - load2(from), load2(to + 2) - load2(from + 2), load2(to + 4) - load2(from + 4),
          load2(to + 6) - load2(from + 6)};
}
// As many rows as Double has lanes, one row per lane.
struct MotionLanes {
  Vec3<Double> t0, t1;
};
HPCCD_HD MotionLanes transposed(const MotionRow r[double_width]) {
  const Double xy_t0[2] = {r[0].xy_t0, r[1].xy_t0}, z_t0[2] = {r[0].z_t0, r[1].z_t0};
  const Double xy_t1[2] = {r[0].xy_t1, r[1].xy_t1}, z_t1[2] = {r[0].z_t1, r[1].z_t1};
  return {transposed(xy_t0, z_t0), transposed(xy_t1, z_t1)};
}

// The same for a snapshot: x y z and padding, of as many points as Double has lanes.
struct PointRows {
  Double xy[double_width], z[double_width];
};
HPCCD_HD PointRows point_rows(const double* const at[double_width]) {
  return {{load2(at[0]), load2(at[1])}, {load2(at[0] + 2), load2(at[1] + 2)}};
}
HPCCD_HD PointRows difference(const PointRows& to, const PointRows& from) {
  return {{to.xy[0] - from.xy[0], to.xy[1] - from.xy[1]}, {to.z[0] - from.z[0], to.z[1] - from.z[1]}};
}
HPCCD_HD Vec3<Double> transposed(const PointRows& r) { return transposed(r.xy, r.z); }

// Rows of eight floats, x y z and padding at t = 0, then at t = 1: as many as Single has lanes.
struct RoundedRows {
  Single t0[4], t1[4];
};
template <class Row>
HPCCD_HD RoundedRows rounded_rows(Row&& at) {
  RoundedRows r;
  for (int i = 0; i < 4; ++i) r.t0[i] = Single(load4(at(i))), r.t1[i] = Single(load4(at(i) + 4));
  return r;
}
HPCCD_HD RoundedRows difference(const RoundedRows& to, const RoundedRows& from) {
  RoundedRows d;
  for (int i = 0; i < 4; ++i) d.t0[i] = to.t0[i] - from.t0[i], d.t1[i] = to.t1[i] - from.t1[i];
  return d;
}
HPCCD_HD Vec3<Single> transposed(const Single r[4]) {
  const Floats4 xy_a = __builtin_shufflevector(r[0].v, r[1].v, 0, 4, 1, 5),
                z_a = __builtin_shufflevector(r[0].v, r[1].v, 2, 6, 3, 7),
                xy_b = __builtin_shufflevector(r[2].v, r[3].v, 0, 4, 1, 5),
                z_b = __builtin_shufflevector(r[2].v, r[3].v, 2, 6, 3, 7);
  return {Single(__builtin_shufflevector(xy_a, xy_b, 0, 1, 4, 5)),
          Single(__builtin_shufflevector(xy_a, xy_b, 2, 3, 6, 7)),
          Single(__builtin_shufflevector(z_a, z_b, 0, 1, 4, 5))};
}
struct RoundedLanes {
  Vec3<Single> t0, t1;
};
HPCCD_HD RoundedLanes transposed(const RoundedRows& r) { return {transposed(r.t0), transposed(r.t1)}; }

// A cache line of sixteen floats.
struct Floats16 {
  Floats4 part[4];
};
HPCCD_HD Floats16 load16(const float* x) { return {{load4(x), load4(x + 4), load4(x + 8), load4(x + 12)}}; }
HPCCD_HD Floats16 all16(float x) {
  const Floats4 all = {x, x, x, x};
  return {{all, all, all, all}};
}
HPCCD_HD Floats16 operator+(const Floats16& a, const Floats16& b) {
  Floats16 r;
  for (int i = 0; i < 4; ++i) r.part[i] = a.part[i] + b.part[i];
  return r;
}
HPCCD_HD Floats16 operator-(const Floats16& a, const Floats16& b) {
  Floats16 r;
  for (int i = 0; i < 4; ++i) r.part[i] = a.part[i] - b.part[i];
  return r;
}
HPCCD_HD Floats16 operator*(const Floats16& a, const Floats16& b) {
  Floats16 r;
  for (int i = 0; i < 4; ++i) r.part[i] = a.part[i] * b.part[i];
  return r;
}
// The first eight, twice.
HPCCD_HD Floats16 first_half_twice(const Floats16& x) { return {{x.part[0], x.part[1], x.part[0], x.part[1]}}; }
HPCCD_HD Floats16 min(const Floats16& a, const Floats16& b) {
  Floats16 r;
  for (int i = 0; i < 4; ++i) r.part[i] = min4(a.part[i], b.part[i]);
  return r;
}
HPCCD_HD Floats16 max(const Floats16& a, const Floats16& b) {
  Floats16 r;
  for (int i = 0; i < 4; ++i) r.part[i] = max4(a.part[i], b.part[i]);
  return r;
}

// Sixteen results.
struct Mask16 {
  Mask4 part[4] = {};
  // Bit j: lane j.
  HPCCD_HD unsigned bits() const { return bits16(part); }
};
HPCCD_HD Mask16 operator&(const Mask16& a, const Mask16& b) {
  Mask16 r;
  for (int i = 0; i < 4; ++i) r.part[i] = a.part[i] & b.part[i];
  return r;
}
HPCCD_HD Mask16 operator|(const Mask16& a, const Mask16& b) {
  Mask16 r;
  for (int i = 0; i < 4; ++i) r.part[i] = a.part[i] | b.part[i];
  return r;
}
HPCCD_HD Mask16 less(const Floats16& a, const Floats16& b) {
  Mask16 r;
  for (int i = 0; i < 4; ++i) r.part[i] = a.part[i] < b.part[i];
  return r;
}
// Whether for some j < 8 lanes j and j + 8 of a, or of b, are both true.
HPCCD_HD bool any_in_both_halves(const Mask16& a, const Mask16& b) {
  const Mask4 low = (a.part[0] & a.part[2]) | (b.part[0] & b.part[2]);
  return any4(low | (a.part[1] & a.part[3]) | (b.part[1] & b.part[3]));
}

// As many floats as a register holds, and the result of comparing six pairs of them.
struct Row {
  Floats4 v;
};
struct RowMask {
  Mask4 v;
};
inline constexpr std::uint32_t row_width = 4;
HPCCD_HD Row load_row(const float* x) { return {load4(x)}; }
HPCCD_HD Row all_lanes(float x) { return {Floats4{x, x, x, x}}; }
HPCCD_HD void store(float* out, Row x) { __builtin_memcpy(out, &x, sizeof x); }
HPCCD_HD Row operator+(Row a, Row b) { return {a.v + b.v}; }
HPCCD_HD Row operator-(Row a, Row b) { return {a.v - b.v}; }
HPCCD_HD Row operator*(Row a, Row b) { return {a.v * b.v}; }
HPCCD_HD RowMask less(Row a, Row b) { return {a.v < b.v}; }
HPCCD_HD RowMask operator&(RowMask a, RowMask b) { return {a.v & b.v}; }

struct SideBits {
  Mask4 v;
};
HPCCD_HD SideBits side_bits(const RowMask* m) {
  Mask4 all = m[0].v & 1;
  for (int i = 1; i < 6; ++i) all |= m[i].v & (1 << i);
  return {all};
}

// Rows of sixteen floats that are used repeatedly: in registers if these are as long as a row.
template <std::uint32_t n>
struct Rows16 {
  const float (*rows)[16];
  HPCCD_HD Floats16 operator[](std::uint32_t i) const { return load16(rows[i]); }
};
template <std::uint32_t n>
HPCCD_HD Rows16<n> load_rows(const float (&rows)[n][16]) {
  return {rows};
}

// Sixteen numbers.
using Numbers16 = NumbersInMemory;
HPCCD_HD Numbers16 load_numbers(const std::uint32_t* numbers) { return {numbers}; }
