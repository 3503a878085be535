// SPDX-License-Identifier: Apache-2.0
// The earliest contact of a query in integers of one type.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "elementary/exact/isolate.h"
#include "elementary/exact/query.h"
#include "elementary/exact/sign_at_root.h"

namespace hpccd::exact {

struct Answer {
  bool decided;  // false: with integers of this size it stays open
  std::optional<double> toc;
};

// m / 2^62, rounded down to a double.
inline double rounded_down(std::int64_t m) {
  const int spare = 64 - 53 - std::countl_zero(static_cast<std::uint64_t>(m));
  if (spare > 0) m = m >> spare << spare;
  return std::ldexp(static_cast<double>(m), -time_bits);
}

template <class Z>
bool touches_at_start(const Query<Z>& q) {
  return sign(q.f.c[0]) == 0 && touches(q, [](const auto& p) { return sign(p.c[0]); });
}

// The first of the roots at which the features touch.
template <class Z, class Begin, class End>
Answer first_touching(const Query<Z>& q, Begin begin, End end) {
  for (auto root = begin; root != end; ++root) {
    bool open = false;
    const bool touching = touches(q, [&](const auto& p) { return open ? 0 : sign_at(p, *root, open); });
    if (open) return {false, {}};
    if (!touching) continue;
    locate(*root);
    return {true, rounded_down(root->time())};
  }
  return {true, {}};
}

template <class Z>
Answer earliest_coplanar(const Query<Z>& q) {
  std::vector<Root<typename Query<Z>::Square, 2>> events;
  bool complete = true;
  for_event_polynomials(q, [&](const auto& p) {
    if (p.degree() < 1) return;
    Roots roots(p);
    complete = complete && roots.complete;
    for (int i = 0; i < roots.n; ++i) {
      locate(roots.root[i]);
      events.push_back(roots.root[i]);
    }
  });
  if (!complete) return {false, {}};
  // Events in the wrong order have the same time.
  std::stable_sort(events.begin(), events.end(), [](const auto& x, const auto& y) { return x.time() < y.time(); });
  return first_touching(q, events.begin(), events.end());
}

template <class Z>
bool certainly_no_root(const Polynomial<Z, 3>& f) {
  const auto b = detail::to_bernstein(f, 3);
  const int s = sign(b.b[0]);
  for (int i = 1; i <= b.n; ++i)
    if (sign(b.b[i]) != s) return false;
  return s != 0;
}

template <class Z>
Answer earliest(const Query<Z>& q) {
  if (certainly_no_root(q.f)) return {true, {}};
  if (touches_at_start(q)) return {true, 0.0};
  const int degree = q.f.degree();
  if (degree < 0) return earliest_coplanar(q);
  if (degree == 0) return {true, {}};
  Roots roots(q.f);
  if (!roots.complete) return {false, {}};
  return first_touching(q, roots.root.begin(), roots.root.begin() + roots.n);
}

}  // namespace hpccd::exact
