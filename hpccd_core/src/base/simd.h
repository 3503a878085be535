// SPDX-License-Identifier: Apache-2.0
// The instruction sets of this machine.
#pragma once

#include "hpccd/hpccd.h"

namespace hpccd {

// The best usable set where `wanted` is automatic; throws InvalidArgument where this machine lacks what is wanted.
Simd resolve(Simd wanted);

const char* name_of(Simd simd);

}  // namespace hpccd
