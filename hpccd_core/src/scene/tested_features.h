// SPDX-License-Identifier: Apache-2.0
// Checks the features to be tested.
#pragma once

#include <string>

#include "hpccd/hpccd.h"

namespace hpccd {

// Throws InvalidArgument with the name of the argument if nothing would be tested.
inline void require_some(const char* name, TestedFeatures features) {
  if (!features.vertex_face && !features.edge_edge)
    throw InvalidArgument(std::string(name) +
                          ": neither vertex-face nor edge-edge is left to test; name one of them, or leave meshes out "
                          "by ignore_pair");
}

}  // namespace hpccd
