// SPDX-License-Identifier: Apache-2.0
// What the motions of one world among many leave for its next one; all else lasts a call, and is a thread's.
#pragma once

#include "backends/moving_tree.h"
#include "backends/near_list.h"

namespace hpccd {

struct WorldMemory {
  OwnTree tree;
  NearList near;
  double seconds = 0;  // that its last call took

  std::size_t bytes() const { return sizeof *this + near.bytes() + (tree.kept ? tree.kept->tree.bytes() : 0); }
};

}  // namespace hpccd
