// SPDX-License-Identifier: Apache-2.0
#include "base/lanes.h"
#define HPCCD_ISA scalar
namespace hpccd::HPCCD_ISA {
using Real = double;
}
#include "elementary/batch.inl"
