// SPDX-License-Identifier: Apache-2.0
// The time of work that is too short to be timed each time: two readings of the clock cost a quarter of a pair of
// leaves. One in 64 is timed and represents all. At its start the clock is read twice, which measures the cost of a
// reading.
#pragma once

#include <chrono>
#include <cstdint>

namespace hpccd {

class SampledTime {
 public:
  // Does the work. `number`: count of previous calls. `elsewhere`: seconds that increase meanwhile and do not belong to
  // this work.
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
