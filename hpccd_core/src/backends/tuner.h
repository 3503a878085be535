// SPDX-License-Identifier: Apache-2.0
// Selects the backend for "auto": the first steps use each backend in turn, the rest the fastest one.
#pragma once

#include <limits>
#include <vector>

#include "hpccd/hpccd.h"

namespace hpccd {

class Tuner {
 public:
  // At least one must be usable. Which ones are may change from step to step.
  Backend next(const std::vector<Backend>& usable) const;

  // A step for this backend: its time, or that it was computed elsewhere.
  void took(Backend backend, double ms);
  void failed(Backend backend) { ++trial(backend).steps; }

 private:
  // The first step of each backend warms up (a GPU's context alone takes 350 ms), and one of the next two may be
  // disturbed.
  static constexpr int steps_each = 3;
  struct Trial {
    int steps = 0;
    double best_ms = std::numeric_limits<double>::infinity();
  };
  Trial& trial(Backend b) { return trials_[static_cast<int>(b)]; }
  const Trial& trial(Backend b) const { return trials_[static_cast<int>(b)]; }
  Trial trials_[4];  // by backend
};

}  // namespace hpccd
