// SPDX-License-Identifier: Apache-2.0
#include "base/lanes.h"
#define HPCCD_ISA avx2
namespace hpccd::HPCCD_ISA {
using Double = Lanes<double, 4>;
using Single = Lanes<float, 8>;
}  // namespace hpccd::HPCCD_ISA
#include "elementary/batch.inl"
