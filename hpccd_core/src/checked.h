// SPDX-License-Identifier: Apache-2.0
// Checks the inputs of a Detector before they are used.
#pragma once

#include <memory>

#include "hpccd/hpccd.h"

namespace hpccd {

// The scene again. Throws InvalidArgument where it is null, or an option is out of its range; what depends on the
// machine or the scene is refused where it is used.
std::shared_ptr<const Scene> checked(std::shared_ptr<const Scene> scene, const Options& options);

// Throws InvalidArgument where there is a number of rows, but no memory that holds them.
void check_memory(const char* name, Positions vertices);

}  // namespace hpccd
