// SPDX-License-Identifier: Apache-2.0
#include "base/simd/avx512.h"
// Must come after the header of the instruction set.
#include "traverse/leaf_edge_faces.inl"
