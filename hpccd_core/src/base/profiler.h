// SPDX-License-Identifier: Apache-2.0
// Wall-clock time of the stages of one call. The time outside all stages is the remainder, reported as "other".
#pragma once

#include <chrono>
#include <map>
#include <string>

namespace hpccd {

class Profiler {
 public:
  using Clock = std::chrono::steady_clock;

  void begin() {
    stages_.clear();
    start_ = last_ = Clock::now();
  }
  // Assigns the time since the last mark to `stage`.
  void mark(const char* stage) {
    const auto now = Clock::now();
    stages_[stage] += milliseconds(now - last_);
    last_ = now;
  }
  // The same, with `ms` of it assigned to `part`.
  void mark_split(const char* stage, const char* part, double ms) {
    mark(stage);
    stages_[stage] -= ms;
    stages_[part] += ms;
  }
  void end() {
    const double total = milliseconds(Clock::now() - start_);
    double known = 0;
    for (const auto& [name, ms] : stages_) known += ms;
    stages_["other"] = total - known;
    stages_["total"] = total;
  }
  const std::map<std::string, double>& stages() const { return stages_; }

 private:
  static double milliseconds(Clock::duration d) { return std::chrono::duration<double, std::milli>(d).count(); }
  std::map<std::string, double> stages_;
  Clock::time_point start_, last_;
};

}  // namespace hpccd
