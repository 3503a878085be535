// SPDX-License-Identifier: Apache-2.0
// Data of one world that is kept from one motion to the next. All other data lasts one call and belongs to a thread.
#pragma once

#include "backends/moving_tree.h"
#include "backends/near_list.h"
#include "solid/containment.h"

namespace hpccd {

struct WorldMemory {
  OwnTree tree;
  NearList near;
  ContainmentMemory containment;
  double seconds = 0;  // time of its last call

  std::size_t bytes() const {
    return sizeof *this + near.bytes() + containment.bytes() + (tree.kept ? tree.kept->tree.bytes() : 0);
  }
};

}  // namespace hpccd
