// SPDX-License-Identifier: Apache-2.0
// Splits a set of primitives along the widest axis of their centers, to build the tree.
#pragma once

#include <cstdint>

#include "base/parallel.h"

namespace hpccd {

// Of a primitive, or of a whole mesh, and its number. Times four: only the order matters.
struct Centroid {
  float center[3];
  std::uint32_t number;
};

// Puts the `left` lowest of the set first, 0 < left < n, in any order on either side. Ties are decided by number, so
// that each side holds the same ones everywhere. `scratch` has room for n.
void split(Centroid* set, std::uint32_t n, std::uint32_t left, Centroid* scratch,
           const Cancellation& cancellation = never_cancelled);

// The same by all threads of the pool, for sets so large that they would leave the others without work.
void split_together(Centroid* set, std::uint32_t n, std::uint32_t left, Centroid* scratch, ThreadPool& pool);

}  // namespace hpccd
