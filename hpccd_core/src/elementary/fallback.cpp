// SPDX-License-Identifier: Apache-2.0
#include "elementary/fallback.h"

#include <algorithm>
#include <cmath>

#include "elementary/coincidence.h"
#include "elementary/distance/extended_separation.h"
#include "elementary/distance/proximity_test.h"
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

// Whether the features are within d at the start. Meshes that rest or slide exactly at their separation have many such
// pairs, which no floating-point precision decides. Integers for one time take 0.7 us; the search over time followed by
// integers over time takes 25 us. Doubles decide most other pairs first.
template <Kind kind>
bool within_at_start(const UndecidedPair& q, FallbackCounts& counts) {
  using S = Spans<kind>;
  const auto span = [&](int to, int from) { return q.t0[to] - q.t0[from]; };
  const Snapshot<double> start{span(S::p_to, S::p_from), span(S::a_to, S::a_from), span(S::b_to, S::b_from)};
  if (proximity_test<kind>(start, q.separation).far) return false;
  if (!exact::within(kind, q.t0, q.separation)) return false;
  ++counts.integers;
  return true;
}

template <Kind kind>
std::optional<double> extended_or_exact(const UndecidedPair& q, FallbackCounts& counts) {
  if (!(q.apart_until > 0) && within_at_start<kind>(q, counts)) return 0;
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
  // The exact result is conservative as well.
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
  // Rounding may bring it above the separation, which it cannot exceed.
  return std::min(exact::distance(q.kind, q.t0), q.separation);
}

}  // namespace hpccd
