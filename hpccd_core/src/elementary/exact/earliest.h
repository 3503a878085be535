// SPDX-License-Identifier: Apache-2.0
// The earliest contact of a query in integers of one type.
#pragma once

#include <optional>

#include "elementary/exact/isolate.h"
#include "elementary/exact/query.h"
#include "elementary/exact/sign_at_root.h"

namespace hpccd::exact {

struct Answer {
  bool decided;  // false: undecided with integers of this size
  std::optional<double> toc;
};

// m / 2^62, rounded down to a double.
HPCCD_HOST_DEVICE inline double rounded_down(std::int64_t m) {
  const int spare = 64 - 53 - leading_zeros(static_cast<std::uint64_t>(m));
  if (spare > 0) m = m >> spare << spare;
  return std::ldexp(static_cast<double>(m), -time_bits);
}

template <class Z>
HPCCD_HOST_DEVICE bool touches_at_start(const Query<Z>& q) {
  return sign(q.f.c[0]) == 0 && touches(q, [](const auto& p) { return sign(p.c[0]); });
}

// The first root at which the features touch.
template <class Z, class R>
HPCCD_HOST_DEVICE Answer first_touching(const Query<Z>& q, R* roots, int n) {
  for (int i = 0; i < n; ++i) {
    bool open = false;
    const bool touching = touches(q, [&](const auto& p) { return open ? 0 : sign_at(p, roots[i], open); });
    if (open) return {false, {}};
    if (!touching) continue;
    locate(roots[i]);
    return {true, rounded_down(roots[i].time())};
  }
  return {true, {}};
}

// Roots of several polynomials, sorted by time. Roots in the wrong order have the same rounded time.
template <class Z>
struct Events {
  static constexpr int most = 10;  // two of each polynomial: of n_k, and of at most four conditions
  std::array<Root<Z, 2>, most> root;
  int n = 0;

  HPCCD_HOST_DEVICE void add(const Root<Z, 2>& r) {
    int at = n++;
    for (; at > 0 && r.time() < root[at - 1].time(); --at) root[at] = root[at - 1];
    root[at] = r;
  }
};

template <class Z>
HPCCD_HOST_DEVICE_CALL Answer earliest_coplanar(const Query<Z>& q) {
  Events<typename Query<Z>::Square> events;
  bool complete = true;
  for_event_polynomials(q, [&](const auto& p) {
    if (p.degree() < 1) return;
    Roots roots(p);
    complete = complete && roots.complete;
    for (int i = 0; i < roots.n; ++i) {
      locate(roots.root[i]);
      events.add(roots.root[i]);
    }
  });
  if (!complete) return {false, {}};
  return first_touching(q, events.root.data(), events.n);
}

template <class Z>
HPCCD_HOST_DEVICE bool certainly_no_root(const Polynomial<Z, 3>& f) {
  const auto b = detail::to_bernstein(f, 3);
  const int s = sign(b.b[0]);
  for (int i = 1; i <= b.n; ++i)
    if (sign(b.b[i]) != s) return false;
  return s != 0;
}

template <class Z>
HPCCD_HOST_DEVICE_CALL Answer earliest(const Query<Z>& q) {
  if (certainly_no_root(q.f)) return {true, {}};
  if (touches_at_start(q)) return {true, 0.0};
  const int degree = q.f.degree();
  if (degree < 0) return earliest_coplanar(q);
  if (degree == 0) return {true, {}};
  Roots roots(q.f);
  if (!roots.complete) return {false, {}};
  return first_touching(q, roots.root.data(), roots.n);
}

}  // namespace hpccd::exact
