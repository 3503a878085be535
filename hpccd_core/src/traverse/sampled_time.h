// SPDX-License-Identifier: Apache-2.0
// The time of work that is too short to be timed each time: to look at the clock twice takes a quarter of what a pair
// of leaves does. One time of 64 is timed and stands for all; where it begins, the clock is looked at twice, which
// tells what a look takes.
#pragma once

#include <chrono>
#include <cstdint>

namespace hpccd {

class SampledTime {
 public:
  // Does the work. `number`: how many times before; `elsewhere`: seconds that grow meanwhile and belong to others.
  template <class Work>
  void run(std::uint64_t number, const double& elsewhere, Work&& work) {
    if (number % every != 0) return work();
    const double others = elsewhere;
    const auto look = Clock::now(), begin = Clock::now();
    work();
    const auto end = Clock::now();
    const double took = in_seconds(end - begin) - in_seconds(begin - look) - (elsewhere - others);
    seconds_ += took > 0 ? every * took : 0;
  }
  double seconds() const { return seconds_; }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::uint64_t every = 64;
  static double in_seconds(Clock::duration d) { return std::chrono::duration<double>(d).count(); }
  double seconds_ = 0;
};

}  // namespace hpccd
