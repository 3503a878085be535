// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/contact.h"

#include "elementary/exact/wide/approach.h"
#include "elementary/exact/wide/earliest.h"

namespace hpccd::exact {
namespace {

double coordinate(const Vec3<double>& v, int k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; }

// The coordinates of a query, by axis, and the power of two that makes each axis integers.
struct Given {
  OddMantissa begin[3][4], end[3][4];
  int low[3], bits = 1;

  Given(const Vec3<double> q_t0[4], const Vec3<double> q_t1[4]) {
    for (int k = 0; k < 3; ++k) {
      BitRange range;
      for (int i = 0; i < 4; ++i) {
        range.include(begin[k][i] = OddMantissa(coordinate(q_t0[i], k)));
        range.include(end[k][i] = OddMantissa(coordinate(q_t1[i], k)));
      }
      low[k] = range.low;
      bits = std::max(bits, range.bits());
    }
  }

  template <class Z>
  Query<Z> query(Kind kind) const {
    Coordinates<Z> points[4];
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < 3; ++k) {
        const Z z0 = scaled_integer<Z>(begin[k][i], low[k]), z1 = scaled_integer<Z>(end[k][i], low[k]);
        points[i][k] = {{z0, z1 - z0}};
      }
    return {kind, points};
  }
};

bool boxes_apart(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4]) {
  const int split = kind == Kind::vertex_face ? 1 : 2;
  for (int k = 0; k < 3; ++k) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < 4; ++i)
      for (const auto* q : {q_t0, q_t1}) {
        const double x = coordinate(q[i], k);
        low[i >= split] = std::min(low[i >= split], x);
        high[i >= split] = std::max(high[i >= split], x);
      }
    if (high[0] < low[1] || high[1] < low[0]) return true;
  }
  return false;
}

}  // namespace

std::optional<double> earliest_contact(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4]) {
  if (boxes_apart(kind, q_t0, q_t1)) return std::nullopt;
  const Given given(q_t0, q_t1);
  Answer answer{false, {}};
  if (given.bits <= Widths<Integer<1>>::coordinate_bits)
    answer = earliest(given.query<Integer<1>>(kind));
  else if (given.bits <= Widths<Integer<2>>::coordinate_bits)
    answer = earliest(given.query<Integer<2>>(kind));
  if (!answer.decided) answer = earliest(given.query<Big>(kind));
  return answer.toc;
}

Approach approach(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4], double toc) {
  const Given given(q_t0, q_t1);
  std::optional<Approach> answer;  // nothing: undecided
  if (given.bits <= Widths<Integer<1>>::coordinate_bits)
    answer = approach(given.query<Integer<1>>(kind), given.low, toc);
  else if (given.bits <= Widths<Integer<2>>::coordinate_bits)
    answer = approach(given.query<Integer<2>>(kind), given.low, toc);
  if (!answer) answer = approach(given.query<Big>(kind), given.low, toc);
  return *answer;
}

}  // namespace hpccd::exact
