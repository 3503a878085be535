// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/wide/first_time.h"

#include <numeric>

#include "elementary/exact/wide/common_roots.h"

namespace hpccd::exact::wide {
namespace {

// Below this number of bits, a test whether a polynomial vanishes is rarely worth its cost.
constexpr int patience = 40;

std::int64_t floor_of(const Dyadic& x) {
  const int excess = x.k - time_bits;
  return static_cast<std::int64_t>(excess < 0 ? Big(x.m << -excess) : Big(x.m >> excess));
}

// The floor just before x.
std::int64_t floor_before(const Dyadic& x) { return x.k < time_bits ? floor_of(x) - 1 : floor_of({x.m - 1, x.k}); }

int sign_at_time(Coefficients q, const Dyadic& t) { return q.empty() ? 0 : sign_at_dyadic(q, t.m, t.k); }

// Narrows a part with one root, which may turn out to be the middle of the part.
void narrow(Part& part, std::optional<Dyadic>& exact) {
  if (part.narrow()) return;
  auto halves = part.halves();
  if (halves.root_between) exact = halves.second.window().begin();
  part = halves.first.variations() ? std::move(halves.first) : std::move(halves.second);
}

// Whether the single simple root in the part is a root of a factor: then the factor has an odd number of roots there.
bool holds_root(const Numbers& factor, const Part& part) {
  return factor.size() > 1 && Part(factor, part.window()).variations() % 2 == 1;
}

}  // namespace

FirstTime::FirstTime(const Event& event)
    : of_(event.vanishes.begin(), event.vanishes.end()), not_zero_{event.not_zero, {}} {
  for (const Coefficients& q : event.at_least_zero) at_least_zero_.push_back({q, {}});
}

std::optional<std::int64_t> FirstTime::in(const Window& window, std::int64_t from, std::int64_t limit) {
  from_ = from, limit_ = limit;
  const Part part(of_, window);
  const bool at_end = part.root_at_end();
  Open all(at_least_zero_.size());
  std::iota(all.begin(), all.end(), 0);
  if (const auto t = within(part, std::move(all))) return t;
  if (at_end && holds_at(window.end())) return floor_of(window.end());
  return {};
}

// open: conditions that may be negative somewhere in the part.
std::optional<std::int64_t> FirstTime::within(Part part, Open open) {
  while (part.variations() > 0) {
    if (floor_of(part.window().begin()) >= limit_ || floor_of(part.window().end()) < from_) return {};
    if (excluded(part.window(), open)) return {};
    if (part.variations() == 1) return at_root(std::move(part), open);
    if (part.window().w > patience && !square_free_) {
      remove_repeated_roots();
      part = Part(of_, part.window());
      continue;
    }
    if (part.narrow()) continue;
    auto [first, second, root_between] = part.halves();
    const bool was_square_free = square_free_;
    if (const auto t = within(std::move(first), open)) return t;
    if (was_square_free != square_free_) second = Part(of_, second.window());
    if (root_between && holds_at(second.window().begin())) return floor_of(second.window().begin());
    part = std::move(second);
  }
  return {};
}

void FirstTime::remove_repeated_roots() {
  square_free_ = true;
  const Numbers repeated = common_factor(of_, derivative(of_));
  if (repeated.size() == 1) return;
  of_ = quotient(std::move(of_), repeated);
  repeated_ = square_free(repeated);
  // Factors of its old value may have repeated roots.
  not_zero_.shared.reset();
  for (Condition& condition : at_least_zero_) condition.shared.reset();
}

// Whether a condition is negative throughout. Removes those that are positive throughout.
bool FirstTime::excluded(const Window& window, Open& open) const {
  for (std::size_t i = open.size(); i-- > 0;) {
    const Coefficients q = at_least_zero_[open[i]].q;
    const int s = q.empty() ? 1 : sign_inside(seen(q, window));
    if (s < 0) return true;
    if (s > 0) open.erase(open.begin() + static_cast<std::ptrdiff_t>(i));
  }
  return false;
}

bool FirstTime::holds_at(const Dyadic& t) const {
  for (const Condition& condition : at_least_zero_)
    if (sign_at_time(condition.q, t) < 0) return false;
  return sign_at_time(not_zero_.q, t) != 0;
}

// For the single simple root in the part.
std::optional<std::int64_t> FirstTime::at_root(Part part, const Open& open) {
  std::optional<Dyadic> exact;
  for (const std::size_t i : open)
    if (sign_at(at_least_zero_[i], part, exact) < 0) return {};
  if (sign_at(not_zero_, part, exact) == 0) return {};
  return time_of(part, exact);
}

int FirstTime::sign_at(Condition& condition, Part& part, std::optional<Dyadic>& exact) {
  if (condition.q.empty()) return 0;
  bool asked = false;
  for (;; narrow(part, exact)) {
    if (exact) return sign_at_time(condition.q, *exact);
    if (const int s = sign_inside(seen(condition.q, part.window()))) return s;
    if (asked || part.window().w < patience) continue;
    asked = true;
    // These are mostly roots at which n vanishes, and with it all conditions.
    if (holds_root(repeated_, part) && divides(repeated_, condition.q)) return 0;
    if (!condition.shared) condition.shared = common_factor(of_, condition.q);
    if (holds_root(*condition.shared, part)) return 0;
  }
}

std::int64_t FirstTime::time_of(Part& part, std::optional<Dyadic>& exact) const {
  for (; !exact; narrow(part, exact)) {
    const std::int64_t first = floor_of(part.window().begin()), last = floor_before(part.window().end());
    if (first == last) return first;
    if (last - first > 1) continue;
    // The root is on one side of that time, or at it.
    const int before = sign(part.polynomial()[0]), s = sign(value(of_, last, time_bits));
    return s == 0 || s == before ? last : first;
  }
  return floor_of(*exact);
}

}  // namespace hpccd::exact::wide
