// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/wide/first_time.h"

#include "elementary/exact/wide/common_roots.h"

namespace hpccd::exact::wide {
namespace {

std::int64_t floor_of(const Dyadic& x) {
  const int excess = x.k - time_bits;
  return static_cast<std::int64_t>(excess < 0 ? Big(x.m << -excess) : Big(x.m >> excess));
}

// Of what lies just before x.
std::int64_t floor_before(const Dyadic& x) { return x.k < time_bits ? floor_of(x) - 1 : floor_of({x.m - 1, x.k}); }

class Search {
 public:
  Search(const Event& event, std::int64_t limit)
      : event_(event), of_(event.vanishes.begin(), event.vanishes.end()), limit_(limit) {}

  std::optional<std::int64_t> in(const Window& window) {
    const Part part(of_, window);
    const bool at_end = part.root_at_end();
    if (const auto t = within(part, event_.at_least_zero)) return t;
    if (at_end && holds_at(window.end())) return floor_of(window.end());
    return {};
  }

 private:
  // Before this many bits it rarely is worth the price to ask whether something vanishes.
  static constexpr int patience = 40;

  // conditions: those that may be negative somewhere in the part.
  std::optional<std::int64_t> within(Part part, std::vector<Coefficients> conditions) {
    while (part.variations() > 0) {
      if (floor_of(part.window().begin()) >= limit_ || excluded(part.window(), conditions)) return {};
      if (part.variations() == 1) return at_root(std::move(part), conditions);
      if (part.window().w > patience && !square_free_) {
        of_ = square_free(of_);
        square_free_ = true;
        part = Part(of_, part.window());
        continue;
      }
      if (part.narrow()) continue;
      auto [first, second, root_between] = part.halves();
      const bool was_square_free = square_free_;
      if (const auto t = within(std::move(first), conditions)) return t;
      if (was_square_free != square_free_) second = Part(of_, second.window());
      if (root_between && holds_at(second.window().begin())) return floor_of(second.window().begin());
      part = std::move(second);
    }
    return {};
  }

  // Whether one is negative throughout. Forgets those that are positive throughout.
  static bool excluded(const Window& window, std::vector<Coefficients>& conditions) {
    for (std::size_t i = conditions.size(); i-- > 0;) {
      const int s = conditions[i].empty() ? 1 : sign_inside(seen(conditions[i], window));
      if (s < 0) return true;
      if (s > 0) conditions.erase(conditions.begin() + static_cast<std::ptrdiff_t>(i));
    }
    return false;
  }

  bool holds_at(const Dyadic& t) const {
    const auto sign_of = [&](Coefficients q) { return q.empty() ? 0 : sign_at_dyadic(q, t.m, t.k); };
    for (const Coefficients& q : event_.at_least_zero)
      if (sign_of(q) < 0) return false;
    return sign_of(event_.not_zero) != 0;
  }

  // Of the one root in the part.
  std::optional<std::int64_t> at_root(Part part, const std::vector<Coefficients>& conditions) {
    std::optional<Dyadic> exact;
    const auto sign_of = [&](Coefficients q) { return sign_at(q, part, exact); };
    for (const Coefficients& q : conditions)
      if (sign_of(q) < 0) return {};
    if (sign_of(event_.not_zero) == 0) return {};
    while (!exact) {
      const std::int64_t first = floor_of(part.window().begin()), last = floor_before(part.window().end());
      if (first == last) return first;
      if (last - first == 1) {
        // The root lies on one side of that time, or there.
        const int before = sign_inside_before(part), s = exact::sign(value(of_, last, time_bits));
        return s == 0 || s == before ? last : first;
      }
      narrow(part, exact);
    }
    return floor_of(*exact);
  }

  // Of the polynomial just after the part begins.
  static int sign_inside_before(const Part& part) { return exact::sign(part.polynomial()[0]); }

  static void narrow(Part& part, std::optional<Dyadic>& exact) {
    if (part.narrow()) return;
    auto halves = part.halves();
    if (halves.root_between) exact = halves.second.window().begin();
    part = halves.first.variations() ? std::move(halves.first) : std::move(halves.second);
  }

  int sign_at(Coefficients q, Part& part, std::optional<Dyadic>& exact) {
    if (q.empty()) return 0;
    bool asked = false;
    for (;; narrow(part, exact)) {
      if (exact) return wide::sign_at_dyadic(q, exact->m, exact->k);
      if (const int s = sign_inside(seen(q, part.window()))) return s;
      if (asked || part.window().w < patience) continue;
      asked = true;
      const Numbers factor = common_factor(of_, q);
      if (factor.size() > 1 && Part(factor, part.window()).variations() % 2 == 1) return 0;
    }
  }

  const Event& event_;
  Numbers of_;
  bool square_free_ = false;
  std::int64_t limit_;
};

}  // namespace

std::optional<std::int64_t> first_time(const Event& event, const Window& window, std::int64_t limit) {
  return Search(event, limit).in(window);
}

}  // namespace hpccd::exact::wide
