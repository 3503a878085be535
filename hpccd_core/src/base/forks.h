// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hpccd {

// How often this process was a child made by fork(), which has no thread of its parent but the one that made it.
int forks();

}  // namespace hpccd
