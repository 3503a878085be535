// SPDX-License-Identifier: Apache-2.0
// The sign of a polynomial at a root of another one.
#pragma once

#include "elementary/exact/wide/root.h"

namespace hpccd::exact::wide {

// Narrows the root if that helps. One of q and root.of() must be of degree 2 at most.
int sign_at(Coefficients q, Root& root);

}  // namespace hpccd::exact::wide
