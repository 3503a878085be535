// SPDX-License-Identifier: Apache-2.0
// Splits a set of primitives along the widest axis of their centers, to build the tree.
#pragma once

#include <cstdint>

#include "base/parallel.h"

namespace hpccd {

// Centroid of a primitive, or of a whole mesh, and its number. Times four: only the order matters.
struct Centroid {
  float center[3];
  std::uint32_t number;
};

// Moves the `left` lowest elements of the set to the front, 0 < left < n, in any order on either side. Ties are broken
// by number, so that the sides are the same on every machine. `scratch` has n elements.
void split(Centroid* set, std::uint32_t n, std::uint32_t left, Centroid* scratch,
           const Cancellation& cancellation = never_cancelled);

// The same with all threads of the pool, for sets so large that one thread would keep the others waiting.
void split_together(Centroid* set, std::uint32_t n, std::uint32_t left, Centroid* scratch, ThreadPool& pool);

}  // namespace hpccd
