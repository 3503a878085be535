// SPDX-License-Identifier: Apache-2.0
// Concatenates the results of many worlds: their rows in order, and the offset of each world.
#pragma once

#include <vector>

#include "base/parallel.h"
#include "hpccd/hpccd.h"

namespace hpccd {

// Joins the worlds' contacts in `all`, which a cancelled call leaves unchanged. The rows of the worlds are released as
// they are copied.
void join_worlds(std::vector<Contacts>& worlds, ThreadPool& pool, Contacts& all);
Intersections join_worlds(std::vector<Intersections>& worlds, ThreadPool& pool);

// Removes the vertex-face and edge-edge contacts of some worlds, from contacts of one world or of many.
void drop_worlds(Contacts& contacts, const std::vector<char>& dropped);

}  // namespace hpccd
