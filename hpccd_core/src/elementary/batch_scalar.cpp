// SPDX-License-Identifier: Apache-2.0
#include "base/lanes.h"
#define HPCCD_ISA scalar
namespace hpccd::HPCCD_ISA {
using Double = double;
using Single = float;
}  // namespace hpccd::HPCCD_ISA
#include "elementary/batch.inl"
