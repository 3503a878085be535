// SPDX-License-Identifier: Apache-2.0
// The instruction sets that this machine supports.
#pragma once

#include "hpccd/hpccd.h"

namespace hpccd {

// The fastest supported set if `wanted` is automatic; throws InvalidArgument if this machine lacks the wanted one.
Simd resolve(Simd wanted);

const char* name_of(Simd simd);

}  // namespace hpccd
