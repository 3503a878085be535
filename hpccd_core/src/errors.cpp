// SPDX-License-Identifier: Apache-2.0
#include "hpccd/errors.h"

namespace hpccd {

// Here rather than in the header: their type information then stands in the library once, for all who catch them.
InvalidArgument::~InvalidArgument() = default;
Cancelled::Cancelled() : std::runtime_error("the detection was cancelled") {}
Cancelled::~Cancelled() = default;

}  // namespace hpccd
