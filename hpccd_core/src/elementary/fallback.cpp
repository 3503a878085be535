// SPDX-License-Identifier: Apache-2.0
#include "elementary/fallback.h"

#include <algorithm>
#include <cmath>

#include "elementary/coincidence.h"
#include "elementary/distance/extended_separation.h"
#include "elementary/exact/contact.h"
#include "elementary/exact/distance.h"
#include "elementary/exact/separation.h"
#include "elementary/tolerance_test.h"

namespace hpccd {
namespace {

bool promises_answers(Accuracy accuracy) { return accuracy == Accuracy::exact || accuracy == Accuracy::conservative; }

template <Kind kind>
std::optional<double> tolerance_contact(const UndecidedPair& q) {
  const tolerance_test::Answer a = tolerance_test::contact<kind>(q.t0, q.t1);
  if (!a.contact) return std::nullopt;
  return a.toc;
}

template <Kind kind>
std::optional<double> extended_or_exact(const UndecidedPair& q, FallbackCounts& counts) {
  const extended_precision::Answer a =
      q.apart_until > 0 ? extended_precision::earliest_within<kind>(q.t0, q.t1, q.separation, q.apart_until)
                        : extended_precision::earliest_within<kind>(q.t0, q.t1, q.separation);
  if (a.none || a.contact) ++counts.extended;
  if (a.none) return std::nullopt;
  if (a.contact) return a.toc;
  ++counts.integers;
  return exact::earliest_within(kind, q.t0, q.t1, q.separation);
}

}  // namespace

std::optional<double> decide_contact(Accuracy accuracy, const UndecidedPair& q, FallbackCounts& counts) {
  // The exact answer is conservative too.
  if (promises_answers(accuracy)) {
    ++counts.integers;
    return exact::earliest_contact(q.kind, q.t0, q.t1);
  }
  ++counts.tolerance;
  return q.kind == Kind::vertex_face ? tolerance_contact<Kind::vertex_face>(q) : tolerance_contact<Kind::edge_edge>(q);
}

std::optional<double> decide_separation(Accuracy, const UndecidedPair& q, FallbackCounts& counts) {
  return q.kind == Kind::vertex_face ? extended_or_exact<Kind::vertex_face>(q, counts)
                                     : extended_or_exact<Kind::edge_edge>(q, counts);
}

std::optional<double> decide_proximity(Accuracy, const UndecidedPair& q, FallbackCounts& counts) {
  const bool touch = q.kind == Kind::vertex_face ? share_a_place<1>(q.t0) : share_a_place<2>(q.t0);
  if (touch) return 0;
  ++counts.integers;
  if (!exact::within(q.kind, q.t0, q.separation)) return std::nullopt;
  // Rounded it may come out above what it is known not to exceed.
  return std::min(exact::distance(q.kind, q.t0), q.separation);
}

}  // namespace hpccd
