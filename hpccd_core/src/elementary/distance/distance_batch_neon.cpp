// SPDX-License-Identifier: Apache-2.0
#include "base/simd/neon.h"
// Must come after the header of the instruction set.
#include "elementary/distance/distance_batch.inl"
