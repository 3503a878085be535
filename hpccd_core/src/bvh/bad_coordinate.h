// SPDX-License-Identifier: Apache-2.0
// The message for positions with a coordinate that is not finite or too large.
#pragma once

#include <charconv>
#include <cmath>
#include <string>

#include "hpccd/hpccd.h"

namespace hpccd {

// False for NaN.
inline bool acceptable(double x, double largest) { return std::fabs(x) <= largest; }

// The shortest decimal that identifies it: 1e+200, not two hundred zeros.
inline std::string shortest(double x) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, x).ptr};
}

template <class Real>
[[noreturn]] void report_bad(const char* name, const Real* x, std::size_t n, double largest) {
  for (std::size_t i = 0; i < n; ++i)
    for (int k = 0; k < 3; ++k) {
      const double value = x[3 * i + k];
      if (acceptable(value, largest)) continue;
      const std::string where = std::string(name) + "[" + std::to_string(i) + ", " + std::to_string(k) + "] is ";
      if (!std::isfinite(value))
        throw InvalidArgument(where + (std::isnan(value) ? "NaN" : "infinite") + "; all coordinates must be finite");
      throw InvalidArgument(where + shortest(value) + ", beyond " + shortest(largest) +
                            ": intermediate results could overflow; scale the scene down");
    }
  throw InvalidArgument(std::string(name) + " changed while it was being read");
}

}  // namespace hpccd
