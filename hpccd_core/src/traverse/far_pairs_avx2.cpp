// SPDX-License-Identifier: Apache-2.0
#include "base/simd/avx2.h"
// Must come after the header of the instruction set.
#include "traverse/far_pairs.inl"
