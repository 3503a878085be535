// SPDX-License-Identifier: Apache-2.0
// From which side the features come together, in integers of any size: never undecided, and in about the same time
// whatever the numbers are.
#pragma once

#include "elementary/exact/approach.h"

namespace hpccd::exact {

Approach approach(const Query<Big>& q, const int low[3], double toc);

}  // namespace hpccd::exact
