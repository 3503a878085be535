// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/wide/sign_at_root.h"

#include <algorithm>

#include "elementary/exact/wide/common_roots.h"

namespace hpccd::exact::wide {
namespace {

// Both, multiplied so that they are coprime, if the second one is `of`: den t - num with the root num / den of r, or a
// multiple of it, if q has that root. The denominator in lowest terms divides q's leading coefficient.
std::vector<Big> common_line(const std::vector<Big>& r, Coefficients q) {
  Big den = abs(gcd(Big(r[1] % q.back()), q.back())), num, rest;
  divide_qr(Big(-r[0] * den), r[1], num, rest);
  if (!rest.is_zero() || sign_at_ratio(q, num, den) != 0) return {};
  return {-num, den};
}

// The common factor of f and q, in lowest terms if it is of degree 1; empty if they have no common root.
std::vector<Big> common_factor(Coefficients f, Coefficients q) {
  if (f.size() < q.size()) std::swap(f, q);
  if (q.size() == 2) return common_line(copied<Big>(q), f);
  auto r = pseudo_remainder(copied<Big>(f), copied<Big>(q));
  while (!r.empty() && r.back().is_zero()) r.pop_back();
  if (r.empty()) return copied<Big>(q);
  return r.size() == 1 ? std::vector<Big>{} : common_line(r, q);
}

bool vanishes_at(Coefficients q, Root& root) {
  if (certainly_no_common_root(root.of(), q)) return false;
  auto factor = common_factor(root.of(), q);
  if (factor.empty() || !root.changes_sign(factor)) return false;
  if (factor.size() < root.of().size()) root.set_factor(std::move(factor));
  return true;
}

}  // namespace

int sign_at(Coefficients q, Root& root) {
  if (q.empty()) return 0;
  if (q.size() == 1) return sign(q[0]);
  if (std::ranges::equal(q, root.of())) return 0;
  // Most signs show before the question whether there is one at all, which costs as much as a few steps, is worth it.
  constexpr int patience = 40;
  bool asked = false;
  std::vector<Big> from_base;
  for (;; root.narrow()) {
    if (root.exact()) return sign_at_dyadic(q, root.low().m, root.low().k);
    if (root.has_base() && from_base.empty()) from_base = root.seen(q);
    if (const int s = root.sign_of_seen(root.has_base() ? from_base : q)) return s;
    if (asked || root.known_bits() < patience) continue;
    asked = true;
    if (vanishes_at(q, root)) return 0;
  }
}

}  // namespace hpccd::exact::wide
