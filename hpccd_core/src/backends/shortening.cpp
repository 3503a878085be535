// SPDX-License-Identifier: Apache-2.0
#include "backends/shortening.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>
#include <utility>

namespace hpccd {
namespace {

double coordinate(Positions p, std::size_t i) {
  return p.is_double ? static_cast<const double*>(p.data)[i]
                     : static_cast<double>(static_cast<const float*>(p.data)[i]);
}

// x, or the float next to it that is nearer to `start`, so that a rounded motion is not longer.
float rounded_towards(double x, float start) {
  const auto nearest = static_cast<float>(x);
  const bool beyond = x > start ? nearest > x : nearest < x;
  return beyond ? std::nextafter(nearest, start) : nearest;
}

// The part of the time before contact that a pair keeps in a round: rounding errors do not matter, and few rounds
// suffice.
constexpr double kept = 0.9;
// Chains of vertices that push each other have taken up to 60 rounds; after that many, pairs go to the floor at once.
constexpr int most_rounds = 100;

}  // namespace

Shortening::Shortening(Positions t0, Positions t1, std::span<const std::int64_t> groups,
                       const Cancellation& cancellation)
    : t0_(t0), t1_(t1), cancellation_(cancellation), factors_(t0.n, 1.0), moves_(t0.n), stuck_(t0.n) {
  if (t0.is_double)
    ends_.assign(static_cast<const double*>(t1.data), static_cast<const double*>(t1.data) + 3 * t1.n);
  else
    float_ends_.assign(static_cast<const float*>(t1.data), static_cast<const float*>(t1.data) + 3 * t1.n);
  for (std::size_t v = 0; v < t0.n; ++v)
    for (std::size_t i = 3 * v; i < 3 * v + 3; ++i) moves_[v] |= coordinate(t0, i) != coordinate(t1, i);
  if (!groups.empty()) {
    slots_.resize(t0.n), grouped_.resize(t0.n);
    std::iota(slots_.begin(), slots_.end(), 0u);
    std::unordered_map<std::int64_t, std::uint32_t> first;
    for (std::uint32_t v = 0; v < t0.n; ++v)
      if (groups[v] >= 0) grouped_[v] = 1, slots_[v] = first.try_emplace(groups[v], v).first->second;
  }
  next_ = factors_;
}

Positions Shortening::end() const {
  return {t0_.is_double ? static_cast<const void*>(ends_.data()) : float_ends_.data(), t0_.n, t0_.is_double};
}

void Shortening::move(std::uint32_t vertex) {
  const double f = factor(vertex);
  for (std::size_t i = 3 * std::size_t{vertex}; i < 3 * std::size_t{vertex} + 3; ++i) {
    const double from = coordinate(t0_, i), to = coordinate(t1_, i), x = f == 1 ? to : from + f * (to - from);
    if (t0_.is_double)
      ends_[i] = x;
    else
      float_ends_[i] = f == 1 ? static_cast<float>(x) : rounded_towards(x, static_cast<float>(from));
  }
}

void Shortening::take(const Touching& pair, double part) {
  bool all_at_floor = true;
  for (const std::uint32_t v : pair.vertices) all_at_floor = all_at_floor && (!moves_[v] || factor(v) <= floor_);
  for (const std::uint32_t v : pair.vertices) {
    double& next = next_[slots_.empty() ? v : slots_[v]];
    if (pair.toc <= 0) {
      stuck_[v] = true;
      if (!grouped_.empty() && grouped_[v]) next = 0;  // also if this one does not move
    }
    if (!moves_[v]) continue;
    const double now = factor(v), shorter = part * pair.toc * now;
    next = std::min(next, all_at_floor || pair.toc <= 0 ? shorter : std::max(shorter, std::min(now, floor_)));
  }
}

std::span<const std::uint32_t> Shortening::shorten(std::span<const Touching> pairs) {
  const auto each_pair = [&](auto&& see) {  // a million take 30 ms
    in_pieces(cancellation_, pairs.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
      for (const Touching& pair : pairs.subspan(begin, end - begin)) see(pair);
    });
  };
  if (floor_ < 0) {
    double first = 1;
    each_pair([&](const Touching& pair) {
      if (pair.toc > 0) first = std::min(first, pair.toc);
    });
    floor_ = kept * first;
  }
  const double part = ++round_ > most_rounds ? 0 : kept;
  // Times are rounded down to 0 too. A pair that touches when nothing changes any more touches at the start.
  std::ranges::fill(stuck_, 0);
  each_pair([&](const Touching& pair) { take(pair, part); });
  changed_.clear();
  for (std::uint32_t v = 0; v < t0_.n; ++v) {
    const std::uint32_t slot = slots_.empty() ? v : slots_[v];
    if (moves_[v] && next_[slot] < factors_[slot]) changed_.push_back(v);
  }
  factors_ = next_;
  for (const std::uint32_t v : changed_) move(v);
  return changed_;
}

CollisionFreeMotion Shortening::result() && {
  CollisionFreeMotion motion;
  motion.vertices = t0_.is_double ? std::move(ends_) : std::vector<double>(float_ends_.begin(), float_ends_.end());
  motion.factors.resize(t0_.n);
  for (std::uint32_t v = 0; v < t0_.n; ++v) {
    motion.factors[v] = factor(v);
    if (stuck_[v]) motion.stuck.push_back(v), motion.factors[v] = 0;
  }
  return motion;
}

}  // namespace hpccd
