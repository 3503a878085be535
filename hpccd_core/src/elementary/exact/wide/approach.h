// SPDX-License-Identifier: Apache-2.0
// The side from which the features approach each other, in integers of any size. Never undecided; the time hardly
// depends on the numbers.
#pragma once

#include "elementary/exact/approach.h"

namespace hpccd::exact {

Approach approach(const Query<Big>& q, const int low[3], double toc);

}  // namespace hpccd::exact
