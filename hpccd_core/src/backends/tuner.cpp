// SPDX-License-Identifier: Apache-2.0
#include "backends/tuner.h"

#include <algorithm>

namespace hpccd {

Backend Tuner::next(const std::vector<Backend>& usable) const {
  for (int n = 0; n < steps_each; ++n)
    for (const Backend b : usable)
      if (trial(b).steps <= n) return b;
  return *std::min_element(usable.begin(), usable.end(),
                           [&](Backend a, Backend b) { return trial(a).best_ms < trial(b).best_ms; });
}

void Tuner::took(Backend backend, double ms) {
  Trial& t = trial(backend);
  ++t.steps;
  t.best_ms = std::min(t.best_ms, ms);
}

}  // namespace hpccd
