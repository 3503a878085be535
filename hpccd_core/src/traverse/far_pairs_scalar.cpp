// SPDX-License-Identifier: Apache-2.0
#include "base/simd/scalar.h"
// After it: written against the instruction set.
#include "traverse/far_pairs.inl"
