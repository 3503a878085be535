// SPDX-License-Identifier: Apache-2.0
#include "base/lanes.h"
#define HPCCD_ISA avx512
namespace hpccd::HPCCD_ISA {
using Double = Lanes<double, 8>;
using Single = Lanes<float, 16>;
}  // namespace hpccd::HPCCD_ISA
#include "elementary/batch.inl"
