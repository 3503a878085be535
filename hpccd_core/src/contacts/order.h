// SPDX-License-Identifier: Apache-2.0
// Sorting of found contacts by their feature pair. No pair is found twice, so the order is unique.
#pragma once

#include <vector>

#include "base/parallel.h"
#include "traverse/worker.h"

namespace hpccd {

// All lists joined, in ascending order of (first, second).
std::vector<Found> sorted(const std::vector<const std::vector<Found>*>& lists, ThreadPool& pool);

}  // namespace hpccd
