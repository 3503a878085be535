// SPDX-License-Identifier: Apache-2.0
// First roots of polynomials that are made of known ones.
#include "elementary/exact/wide/first_time.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "elementary/exact/rounded.h"
#include "elementary/exact/wide/common_roots.h"

namespace hpccd::exact {
namespace {

using wide::Numbers;

struct Ratio {
  Big num, den;  // den > 0
};
bool operator<(const Ratio& a, const Ratio& b) { return a.num * b.den < b.num * a.den; }

std::int64_t floor_of(const Ratio& x) { return static_cast<std::int64_t>(Big((x.num << time_bits) / x.den)); }

// den t - num
Numbers line(const Ratio& root) { return {-root.num, root.den}; }

Numbers product(const Numbers& a, const Numbers& b) {
  Numbers p(a.size() + b.size() - 1);
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) p[i + j] += a[i] * b[j];
  return p;
}

// Fractions of small numbers, some of them next to one another, or next to 0 or 1: `near` bits decide how near.
Ratio random_root(std::mt19937_64& random, int near) {
  const auto den = static_cast<std::int64_t>(random() % 7 + 1);
  Ratio r{static_cast<std::int64_t>(random() % 9) - 1, den};
  if (random() % 2) {
    const int bits = static_cast<int>(random() % near);
    r = {(r.num << bits) + static_cast<int>(random() % 3) - 1, r.den << bits};
  }
  return r;
}

const Numbers one = {1};
constexpr std::int64_t never = std::numeric_limits<std::int64_t>::max();

std::int64_t first_time(const wide::Event& event) { return wide::FirstTime(event).in({}, 0, never).value_or(never); }

// The first root in (0, 1] at which a line, `condition`, is not negative.
std::int64_t expected(std::vector<Ratio> roots, const Ratio& condition, int rises) {
  std::sort(roots.begin(), roots.end());
  for (const Ratio& r : roots) {
    const Big beyond = (r.num * condition.den - condition.num * r.den) * rises;
    if (r.num > 0 && r.num <= r.den && beyond >= 0) return floor_of(r);
  }
  return never;
}

TEST(ExactFirstTime, IsThatOfKnownRoots) {
  std::mt19937_64 random(4);
  for (const int near : {4, 40, 1000})
    for (int i = 0; i < 500; ++i) {
      std::vector<Ratio> roots;
      Numbers p = {random() % 2 ? 1 : -3};
      if (random() % 3 == 0) p = {1, static_cast<int>(random() % 3) - 1, 1};  // no real root
      while (p.size() < 7 && (roots.empty() || random() % 4)) {
        // Some of them twice.
        roots.push_back(roots.empty() || random() % 4 ? random_root(random, near) : roots[random() % roots.size()]);
        p = product(p, line(roots.back()));
      }
      // A condition that begins or ends to hold somewhere, often at a root.
      const Ratio turn = random() % 2 ? roots[random() % roots.size()] : random_root(random, near);
      const int rises = random() % 2 ? 1 : -1;
      Numbers condition = line(turn);
      for (Big& c : condition) c *= rises;
      ASSERT_EQ(first_time({p, one, {condition}}), expected(roots, turn, rises)) << "near " << near << ", number " << i;
    }
}

TEST(ExactFirstTime, PassesOverTimesAtWhichThereIsNothingToMeet) {
  const Numbers p = product(line({1, 3}), line({2, 3})), zero_at_a_third = product(line({1, 3}), line({1, 3}));
  EXPECT_EQ(first_time({p, one, {}}), floor_of({1, 3}));
  EXPECT_EQ(first_time({p, zero_at_a_third, {}}), floor_of({2, 3}));
  // The same for roots that are no fractions: of 2 t^2 - 1, and of 3 t^2 - 2.
  const Numbers half = {-1, 0, 2}, rest = {-2, 0, 3};
  const std::int64_t first = first_time({product(half, rest), one, {}});
  EXPECT_NEAR(std::ldexp(static_cast<double>(first), -time_bits), std::sqrt(0.5), 1e-15);
  const std::int64_t second = first_time({product(half, rest), product(half, half), {}});
  EXPECT_NEAR(std::ldexp(static_cast<double>(second), -time_bits), std::sqrt(2.0 / 3), 1e-15);
}

TEST(ExactFirstTime, CommonFactorsAndRepeatedRootsAreFound) {
  const Numbers a = {-1, 0, 2}, b = {3, 1}, c = {1, 1, 1};
  EXPECT_EQ(wide::common_factor(product(a, b), product(a, c)).size(), a.size());
  EXPECT_EQ(wide::common_factor(product(b, b), product(a, c)).size(), 1u);
  EXPECT_EQ(wide::square_free(product(product(a, a), b)).size(), product(a, b).size());
  EXPECT_EQ(wide::square_free(product(a, b)).size(), product(a, b).size());
}

// Asks integers for the rest, and counts how often.
struct Others {
  const wide::Event& event;
  const Polynomial<Big, 6>& p;
  int asked = 0;
  std::optional<std::int64_t> in_bracket(const Bracket<6>& bracket) { return time_of_root(p, bracket); }
  std::optional<std::int64_t> in_interval(std::int64_t low, int halvings) {
    ++asked;
    return wide::FirstTime(event).in({low, halvings, halvings}, 0, never);
  }
  std::optional<std::int64_t> after(std::int64_t from) {
    ++asked;
    return wide::FirstTime(event).in({}, from, never);
  }
};

TEST(ExactFirstTime, IsTheSameWhereDoublesDecide) {
  std::mt19937_64 random(8);
  int asked = 0, found = 0;
  constexpr int n = 3000;
  for (int i = 0; i < n; ++i) {
    Polynomial<Big, 6> p;
    Polynomial<Big, 4> condition;
    for (Big& c : p.c) c = static_cast<std::int64_t>(random() % 2001) - 1000;
    for (Big& c : condition.c) c = static_cast<std::int64_t>(random() % 2001) - 1000;
    if (p.degree() < 1 || condition.degree() < 0) continue;
    const wide::Event event{wide::coefficients(p), one, {wide::coefficients(condition)}};
    RoundedEvent<6, 4> rounded;
    round(p, rounded.f);
    round(condition, rounded.positive[rounded.n++]);
    Others others{event, p};
    const std::int64_t early = EarlySearch<6, 4, Others>(never, others).first(rounded).value_or(never);
    ASSERT_EQ(early, first_time(event)) << "number " << i;
    asked += others.asked, found += early != never;
  }
  EXPECT_LT(asked, n / 100);
  EXPECT_GT(found, n / 10);
}

}  // namespace
}  // namespace hpccd::exact
