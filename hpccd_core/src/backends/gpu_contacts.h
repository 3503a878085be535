// SPDX-License-Identifier: Apache-2.0
// The public result of a step on the GPU: what the device found, sorted and hashed, with what the CPU decided for it.
#pragma once

#include <vector>

#include "base/parallel.h"
#include "bvh/motion_bounds.h"
#include "elementary/pair.h"
#include "gpu/pipeline.h"
#include "scene/features.h"

namespace hpccd {

// In canonical order.
struct DecidedContacts {
  std::vector<Contact> vertex_face, edge_edge;
};

Contacts join(const gpu::FrameResult& device, const DecidedContacts& decided, const Features& features,
              ThreadPool& pool);

// The device finds all contacts: drops what was not asked for.
void reduce(Contacts& contacts, Report report);

// Those that the options ask for.
void add_points_and_normals(Contacts& contacts, const Options& options, const MotionBounds& motion,
                            const Features& features, ThreadPool& pool);

}  // namespace hpccd
