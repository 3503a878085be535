// SPDX-License-Identifier: Apache-2.0
#include "base/lanes.h"
#define HPCCD_ISA avx2
namespace hpccd::HPCCD_ISA {
using Real = Lanes<double, 4>;
}
#include "elementary/batch.inl"
