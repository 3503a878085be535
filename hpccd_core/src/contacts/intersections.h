// SPDX-License-Identifier: Apache-2.0
// Converts the intersecting edges and faces that the threads found into the public result: canonical order and hash.
#pragma once

#include "base/parallel.h"
#include "contacts/order.h"

namespace hpccd {

Intersections collect_intersections(std::vector<Worker>& workers, const Geometry& geometry, ContactOrder& order,
                                    ThreadPool& pool);

}  // namespace hpccd
