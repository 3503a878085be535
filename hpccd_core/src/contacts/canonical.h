// SPDX-License-Identifier: Apache-2.0
// Converts the contacts that the threads found into the public result: canonical order, hash, earliest time, points
// and normals.
#pragma once

#include "base/parallel.h"
#include "contacts/order.h"
#include "contacts/outputs.h"
#include "elementary/batch.h"
#include "traverse/worker.h"

namespace hpccd {

// Moves the workers' contacts into `contacts`, which must be empty; after a cancellation the contents are unspecified.
// Features are numbered so that their pairs sort into canonical order. `order` keeps its memory from call to call.
void collect_contacts(std::vector<Worker>& workers, const Geometry& geometry, Report report, Outputs outputs,
                      ContactOrder& order, ThreadPool& pool, Contacts& contacts);

}  // namespace hpccd
