// SPDX-License-Identifier: Apache-2.0
// The public result of a step on the GPU: what the device found, sorted and hashed, with what the CPU decided for it.
#pragma once

#include <vector>

#include "base/parallel.h"
#include "contacts/places.h"
#include "elementary/pair.h"
#include "gpu/pipeline.h"
#include "scene/features.h"

namespace hpccd {

// In canonical order.
struct DecidedContacts {
  std::vector<Contact> vertex_face, edge_edge;
};

// Of edges and faces, which the pipeline numbers as vertices and faces.
Intersections join_intersections(const gpu::FrameResult& device, const DecidedContacts& decided,
                                 const Features& features);

Contacts join(const gpu::FrameResult& device, const DecidedContacts& decided, const Features& features,
              ThreadPool& pool);

// The device finds all contacts: drops what was not asked for.
void reduce(Contacts& contacts, Report report);

void add_places(Contacts& contacts, Outputs outputs, const Features& features, const Separations& separations,
                Positions t0, Positions t1, ThreadPool& pool);

}  // namespace hpccd
