// SPDX-License-Identifier: Apache-2.0
#include "hpccd/errors.h"

namespace hpccd {

// Not inline, so that the library contains their type information once, for all users.
InvalidArgument::~InvalidArgument() = default;
Cancelled::Cancelled() : std::runtime_error("the detector was cancelled; create another one") {}
Cancelled::~Cancelled() = default;

}  // namespace hpccd
