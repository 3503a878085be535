// SPDX-License-Identifier: Apache-2.0
// The answers of many worlds as one: their rows one after the other, and where those of each begin.
#pragma once

#include <vector>

#include "base/parallel.h"
#include "hpccd/hpccd.h"

namespace hpccd {

// What the hash of a world counts in the hash of all: the same answers in other worlds are another answer.
constexpr std::uint64_t hash_weight(std::size_t world) { return 2 * std::uint64_t{world} + 1; }

// Into `all`, which is kept by a call that is cancelled. The worlds' rows are given up as they are copied.
void join_worlds(std::vector<Contacts>& worlds, ThreadPool& pool, Contacts& all);
Intersections join_worlds(std::vector<Intersections>& worlds, ThreadPool& pool);

}  // namespace hpccd
