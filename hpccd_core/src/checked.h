// SPDX-License-Identifier: Apache-2.0
// Checks the inputs of a Detector before they are used.
#pragma once

#include <memory>

#include "hpccd/hpccd.h"

namespace hpccd {

// Returns the scene. Throws InvalidArgument if it is null, or if an option is out of range; options that depend on the
// machine or the scene are checked where they are used.
std::shared_ptr<const Scene> checked(std::shared_ptr<const Scene> scene, const Options& options);

// Throws InvalidArgument if there are rows but no memory.
void check_memory(const char* name, Positions vertices);

}  // namespace hpccd
