// SPDX-License-Identifier: Apache-2.0
#include "elementary/fallback.h"

#include "elementary/exact/contact.h"
#include "elementary/separation_filter.h"
#include "elementary/tolerance_test.h"

namespace hpccd {
namespace {

using Points = const Vec3<double>*;

template <Kind kind>
std::optional<double> tolerance_contact(Points q_t0, Points q_t1) {
  const tolerance_test::Answer a = tolerance_test::contact<kind>(q_t0, q_t1);
  if (!a.contact) return std::nullopt;
  return a.toc;
}

template <Kind kind>
std::optional<double> within_separation(const inclusion::Limits& limits, Points q_t0, Points q_t1,
                                        FallbackCounts& counts) {
  const Motion<double> m = motion_of<kind>(q_t0, q_t1);
  if (certainly_separated<kind>(m, limits.separation)) return std::nullopt;
  ++counts.inclusion;
  return inclusion::earliest_within(kind, m, limits);
}

}  // namespace

std::optional<double> decide_undecided(Accuracy accuracy, const inclusion::Limits& limits, Kind kind, Points q_t0,
                                       Points q_t1, FallbackCounts& counts) {
  if (accuracy == Accuracy::conservative && limits.separation > 0)
    return kind == Kind::vertex_face ? within_separation<Kind::vertex_face>(limits, q_t0, q_t1, counts)
                                     : within_separation<Kind::edge_edge>(limits, q_t0, q_t1, counts);
  // Without a separation the exact answer is conservative too, and cheaper than a search that has to give up somewhere.
  if (accuracy == Accuracy::conservative || accuracy == Accuracy::exact) {
    ++counts.integers;
    return exact::earliest_contact(kind, q_t0, q_t1);
  }
  ++counts.tolerance;
  return kind == Kind::vertex_face ? tolerance_contact<Kind::vertex_face>(q_t0, q_t1)
                                   : tolerance_contact<Kind::edge_edge>(q_t0, q_t1);
}

}  // namespace hpccd
