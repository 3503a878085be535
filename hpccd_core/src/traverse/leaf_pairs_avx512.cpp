// SPDX-License-Identifier: Apache-2.0
#define HPCCD_ISA avx512
#include "traverse/leaf_pairs.inl"
