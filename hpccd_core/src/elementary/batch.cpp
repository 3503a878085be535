// SPDX-License-Identifier: Apache-2.0
#include "elementary/batch.h"

#include "base/simd/sets.h"

namespace hpccd {

// The function of batch.inl, compiled for each instruction set.
HPCCD_IN_EACH_SET(BatchTest batch_test(Accuracy);)

BatchTest batch_test(Simd simd, Accuracy accuracy) { return HPCCD_OF_SET(simd, batch_test)(accuracy); }

}  // namespace hpccd
