// SPDX-License-Identifier: Apache-2.0
// Concatenates the results of many worlds: their rows in order, and the offset of each world.
#pragma once

#include <vector>

#include "base/parallel.h"
#include "hpccd/hpccd.h"

namespace hpccd {

// Into `all`, which is kept by a call that is cancelled. The worlds' rows are given up as they are copied.
void join_worlds(std::vector<Contacts>& worlds, ThreadPool& pool, Contacts& all);
Intersections join_worlds(std::vector<Intersections>& worlds, ThreadPool& pool);

}  // namespace hpccd
