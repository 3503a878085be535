// SPDX-License-Identifier: Apache-2.0
// The filtered test with 106 bits of precision, on devices, where integers of hundreds of bits are slow. It decides
// what double precision leaves undecided. Its times of contact are bit-identical to those of exact arithmetic, or it
// does not decide. Exactly degenerate pairs stay undecided, except for contact at t = 0. On cloth-ball 92->93 it
// leaves 7 of 1382 pairs undecided, on n-body none of 3561. (On a CPU the integers take 0.4 to 1.5 us per pair on
// these scenes, this test 0.2 to 3.8.)
#pragma once

#include <cstdint>

#include "base/double_double.h"
#include "elementary/filtered_test.h"

namespace hpccd::extended_precision {

struct Answer {
  bool contact, none;  // neither: undecided
  double toc;
};

HPCCD_HD Vec3<DoubleDouble> difference(Vec3<double> a, Vec3<double> b) {
  return {detail::two_sum(a.x, -b.x), detail::two_sum(a.y, -b.y), detail::two_sum(a.z, -b.z)};
}

// The motion without any rounding.
template <Kind kind>
HPCCD_HD Motion<DoubleDouble> motion_of(const Vec3<double> q0[4], const Vec3<double> q1[4]) {
  return motion_by<kind, DoubleDouble>([&](int end, int to, int from) {
    const Vec3<double>* q = end ? q1 : q0;
    return difference(q[to], q[from]);
  });
}

// floor(x 2^62) for x in [0, 1].
HPCCD_HD std::int64_t grid_point(DoubleDouble x) {
  const double scale = 4611686018427387904.0;  // 2^62
  const double whole = floor(x.high * scale);
  const DoubleDouble rest = detail::two_sum(x.high * scale - whole, x.low * scale);
  const double n = floor(rest.high);
  const bool below = n == rest.high && rest.low < 0;
  return static_cast<std::int64_t>(whole) + static_cast<std::int64_t>(n) - (below ? 1 : 0);
}

// m / 2^62 rounded down to a double: the bits of exact::rounded_down, by what devices have.
HPCCD_HD double rounded_down(std::int64_t m) {
  double d = static_cast<double>(m);  // rounds to nearest
  if (static_cast<std::int64_t>(d) > m) {
    int shift = 0;  // the bits below a double's 53
    while (static_cast<std::uint64_t>(m) >> shift >> 53) ++shift;
    d = static_cast<double>(m >> shift << shift);
  }
  return d * 2.168404344971009e-19;  // 2^-62
}

// Whether the features touch at t = 0, in integers: meshes at rest on one another. False if that is not certain: if the
// coordinates need more than 41 bits, or if the spanning vectors are parallel.
template <Kind kind>
HPCCD_HD bool certainly_touch_at_start(const Motion<DoubleDouble>& m) {
  __extension__ typedef __int128 Wide;  // products of three 41-bit numbers, six of them added: 126 bits
  const DoubleDouble given[9] = {m.p0.x, m.p0.y, m.p0.z, m.a0.x, m.a0.y, m.a0.z, m.b0.x, m.b0.y, m.b0.z};
  double largest = 0;
  for (const DoubleDouble& x : given) {
    if (x.low != 0) return false;
    largest = greater(largest, magnitude(x.high));
  }
  if (!(largest > 0)) return false;
  const int exponent = ilogb(largest);
  std::int64_t v[9];
  for (int i = 0; i < 9; ++i) {
    const double scaled = scalbn(given[i].high, 40 - exponent);
    // Very small numbers are negligible beside the largest ones.
    if (floor(scaled) != scaled || (scaled == 0 && given[i].high != 0)) return false;
    v[i] = static_cast<std::int64_t>(scaled);
  }
  const auto cross = [&](int a, int b, Wide out[3]) {
    out[0] = Wide(v[a + 1]) * v[b + 2] - Wide(v[a + 2]) * v[b + 1];
    out[1] = Wide(v[a + 2]) * v[b] - Wide(v[a]) * v[b + 2];
    out[2] = Wide(v[a]) * v[b + 1] - Wide(v[a + 1]) * v[b];
  };
  Wide n[3], pb[3], ap[3];
  cross(3, 6, n), cross(0, 6, pb), cross(3, 0, ap);
  if (v[0] * n[0] + v[1] * n[1] + v[2] * n[2] != 0) return false;
  for (int k = 0; k < 3; ++k) {
    if (n[k] == 0) continue;
    const Wide sign = n[k] < 0 ? -1 : 1, whole = sign * n[k], alpha = sign * pb[k], beta = sign * ap[k];
    if constexpr (kind == Kind::vertex_face) return alpha >= 0 && beta >= 0 && alpha + beta <= whole;
    return alpha >= 0 && alpha <= whole && beta <= 0 && -beta <= whole;
  }
  return false;
}

// The largest double that is at most x >= 0.
HPCCD_HD double rounded_towards_zero(DoubleDouble x) {
  return x.low < 0 ? x.high - x.high * 1.1102230246251565e-16 : x.high;  // 2^-53: half an ulp or a whole one
}

template <Kind kind>
HPCCD_HD Answer decide(const Vec3<double> q0[4], const Vec3<double> q1[4]) {
  using R = DoubleDouble;
  const Motion<R> m = motion_of<kind>(q0, q1);
  if (certainly_touch_at_start<kind>(m)) return {true, false, 0};
  const Outcome<R> o = many_roots_test<kind, Proven>(m);
  if (o.none) return {false, true, 0};
  if (!o.contact) return {false, false, 0};
  const R early = o.toc - o.delta, late = o.toc + o.delta;
  if (!(early >= R(0) && late <= R(1))) return {false, false, 0};
  const std::int64_t point = grid_point(early);
  if (point != grid_point(late)) return {false, false, 0};
  return {true, false, rounded_down(point)};
}

}  // namespace hpccd::extended_precision
