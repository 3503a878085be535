// SPDX-License-Identifier: Apache-2.0
#define HPCCD_ISA avx2
#include "traverse/leaf_pairs.inl"
