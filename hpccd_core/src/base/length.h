// SPDX-License-Identifier: Apache-2.0
// Lengths given by the caller: separations and distances.
#pragma once

#include <charconv>
#include <cmath>
#include <string>

#include "hpccd/hpccd.h"

namespace hpccd {

// Throws InvalidArgument if it is NaN, infinite or negative: comparisons with such a length would still decide
// something.
inline void check_length(const char* name, double length) {
  if (std::isfinite(length) && length >= 0) return;
  char text[32];
  const char* end = std::to_chars(text, text + sizeof text, length).ptr;
  throw InvalidArgument(std::string(name) + ": must be finite and not negative, got " +
                        std::string(static_cast<const char*>(text), end));
}

}  // namespace hpccd
