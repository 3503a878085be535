// SPDX-License-Identifier: Apache-2.0
// The instruction sets that this machine supports.
#pragma once

#include "hpccd/hpccd.h"

namespace hpccd {

// The best usable set where `wanted` is automatic; throws InvalidArgument where this machine lacks what is wanted.
Simd resolve(Simd wanted);

const char* name_of(Simd simd);

}  // namespace hpccd
