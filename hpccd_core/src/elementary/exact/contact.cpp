// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/contact.h"

#include "elementary/exact/fixed_approach.h"
#include "elementary/exact/wide/approach.h"
#include "elementary/exact/wide/earliest.h"

namespace hpccd::exact {

std::optional<double> earliest_contact(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4]) {
  if (boxes_apart(kind, q_t0, q_t1, 0)) return std::nullopt;
  const GivenMotion given(q_t0, q_t1);
  Answer answer{false, {}};
  if (given.bits <= Widths<Integer<1>>::coordinate_bits)
    answer = earliest(given.query<Integer<1>>(kind));
  else if (given.bits <= Widths<Integer<2>>::coordinate_bits)
    answer = earliest(given.query<Integer<2>>(kind));
  if (!answer.decided) answer = earliest(given.query<Big>(kind));
  return answer.toc;
}

Approach approach(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4], double toc) {
  const GivenMotion given(q_t0, q_t1);
  std::optional<Approach> answer = fixed_approach(kind, given, toc);
  if (!answer) answer = approach(given.query<Big>(kind), given.low, toc);
  return *answer;
}

}  // namespace hpccd::exact
