// SPDX-License-Identifier: Apache-2.0
// Copies results that the CPU has computed to the device where the caller expects them.
#pragma once

#include "hpccd/hpccd.h"

namespace hpccd::gpu {

// Into memory of their own. Throws Error where there is none.
DeviceResults to_device(const Contacts& contacts, int device);
DeviceResults to_device(const Proximity& pairs, int device);
DeviceResults to_device(const Intersections& pairs, int device);

// Adds the places of these contacts to results that are there.
void add_places(DeviceResults& results, const Contacts& with_places);

// A copy of two arrays behind one another, wherever they are.
std::shared_ptr<const void> joined_on_device(const void* a, std::size_t a_bytes, const void* b, std::size_t b_bytes,
                                             int device);

}  // namespace hpccd::gpu
