// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hpccd {

// The number of times that this process is a descendant by fork(). A child has only the thread that called fork().
int forks();

}  // namespace hpccd
