// SPDX-License-Identifier: Apache-2.0
// The earliest contact of a query in integers of any size. Never undecided; the time hardly depends on the numbers.
#pragma once

#include "elementary/exact/earliest.h"

namespace hpccd::exact {

Answer earliest(const Query<Big>& q);

}  // namespace hpccd::exact
