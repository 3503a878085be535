// SPDX-License-Identifier: Apache-2.0
// A short translation that separates two meshes, and a bound that no translation can be shorter than.
#pragma once

#include <optional>

#include "base/parallel.h"
#include "hpccd/results.h"
#include "solid/moved_pair.h"

namespace hpccd {

// start: a translation to begin with, in place of a search in all directions. The same for any number of threads.
Penetration penetration(const MovedPair& pair, const std::optional<Vec3<double>>& start, ThreadPool& pool);

}  // namespace hpccd
