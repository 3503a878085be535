// SPDX-License-Identifier: Apache-2.0
// The first root of a polynomial at which others have the sign that they must.
#pragma once

#include <optional>

#include "elementary/exact/wide/part.h"

namespace hpccd::exact::wide {

struct Event {
  Coefficients vanishes;
  Coefficients not_zero;  // and nowhere negative
  std::vector<Coefficients> at_least_zero;
};

// floor(t 2^62) for the first t in (0, 1], or any number not below `limit` where there is none below it.
std::int64_t first_time(const Event& event, std::int64_t limit);

}  // namespace hpccd::exact::wide
