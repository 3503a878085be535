// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/wide/approach.h"

#include "elementary/exact/wide/isolate.h"
#include "elementary/exact/wide/sign_at_root.h"

namespace hpccd::exact {
namespace {

// The sign of f just before one of its roots, by its lowest derivative that does not vanish.
int sign_before(wide::Coefficients f, wide::Root& root) {
  int before = 1;
  for (auto d = wide::derivative(f);; d = wide::derivative(d)) {
    before = -before;
    if (const int s = wide::sign_at(d, root)) return before * s;
  }
}

// Whether p is the same at both ends, except for its last bits.
bool steady(wide::Coefficients p, const wide::Dyadic& low, const wide::Dyadic& high) {
  constexpr double least_change = 1e-12;
  int e_low, e_high;
  const double at_low = magnitude_of(wide::value(p, low.m, low.k), e_low);
  const double at_high = magnitude_of(wide::value(p, high.m, high.k), e_high);
  if (std::abs(e_low - e_high) > 1) return false;
  return std::fabs(at_low - std::ldexp(at_high, e_high - e_low)) <= least_change * at_low;
}

Approach approach_at(const Query<Big>& q, const int low[3], wide::Root& root) {
  int sign_of_n[3];
  for (int k = 0; k < 3; ++k) {
    const auto n = wide::coefficients(q.n[k]);
    sign_of_n[k] = wide::sign_at(n, root);
    while (sign_of_n[k] && !root.exact() && !steady(n, root.low(), root.high())) root.narrow();
  }
  const wide::Dyadic t = root.low();
  return {sign_before(wide::coefficients(q.f), root),
          detail::direction(q, low, t.m, t.k, [&](int k) { return sign_of_n[k]; })};
}

}  // namespace

Approach approach(const Query<Big>& q, const int low[3], double toc) {
  const int degree = q.f.degree();
  if (degree < 0) return {0, {0, 0, 0}};
  if (degree == 0) return detail::approach_between_roots(q, low, time_of(toc));
  auto roots = wide::roots(wide::coefficients(q.f));
  std::vector<std::int64_t> times;
  for (wide::Root& root : roots) times.push_back(root.time());
  const auto touches_at = [&](int i) {
    return touches(q, [&](const auto& p) { return wide::sign_at(wide::coefficients(p), roots[i]); });
  };
  const int i = detail::root_of_contact(times.data(), static_cast<int>(times.size()), time_of(toc), touches_at);
  return i < 0 ? detail::approach_between_roots(q, low, time_of(toc)) : approach_at(q, low, roots[i]);
}

}  // namespace hpccd::exact
