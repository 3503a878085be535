// SPDX-License-Identifier: Apache-2.0
#include "base/simd/scalar.h"
// Must come after the header of the instruction set.
#include "elementary/batch.inl"
