// SPDX-License-Identifier: Apache-2.0
// From the edges and faces that the threads found to the public result: canonical order and hash.
#pragma once

#include "base/parallel.h"
#include "contacts/order.h"

namespace hpccd {

Intersections collect_intersections(std::vector<Worker>& workers, const Geometry& geometry, ContactOrder& order,
                                    ThreadPool& pool);

}  // namespace hpccd
