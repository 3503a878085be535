// SPDX-License-Identifier: Apache-2.0
#define HPCCD_ISA scalar
#include "traverse/leaf_pairs.inl"
