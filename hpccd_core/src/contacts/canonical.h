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

// Takes what the workers found into contacts that hold nothing yet; where this is cancelled, they hold anything.
// Features are numbered so that their pairs sort into the canonical order. `order` keeps its memory from call to call.
void collect_contacts(std::vector<Worker>& workers, const Geometry& geometry, Report report, Outputs outputs,
                      ContactOrder& order, ThreadPool& pool, Contacts& contacts);

}  // namespace hpccd
