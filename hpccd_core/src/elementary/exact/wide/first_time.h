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

// floor(t 2^62) for the first t in the window, its end included and its beginning not, if it is below `limit`.
std::optional<std::int64_t> first_time(const Event& event, const Window& window, std::int64_t limit);

}  // namespace hpccd::exact::wide
