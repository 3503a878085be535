// SPDX-License-Identifier: Apache-2.0
// Copies results that the CPU has computed to the device where the caller expects them.
#pragma once

#include "hpccd/hpccd.h"

namespace hpccd::gpu {

// Copies into new memory. Throws Error if there is not enough.
DeviceResults to_device(const Contacts& contacts, int device);
DeviceResults to_device(const Proximity& pairs, int device);
DeviceResults to_device(const Intersections& pairs, int device);

// Adds points and normals of these contacts to existing results.
void add_places(DeviceResults& results, const Contacts& with_places);

// A copy of two arrays one after the other, wherever they are.
std::shared_ptr<const void> joined_on_device(const void* a, std::size_t a_bytes, const void* b, std::size_t b_bytes,
                                             int device);

}  // namespace hpccd::gpu
