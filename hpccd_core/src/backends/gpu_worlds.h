// SPDX-License-Identifier: Apache-2.0
// What a frame of many worlds found, as the caller sees it.
#pragma once

#include "base/parallel.h"
#include "contacts/places.h"
#include "gpu/pipeline.h"
#include "scene/features.h"

namespace hpccd {

// From page-locked memory.
Contacts contacts_of(const gpu::FrameResult& frame, std::size_t n_worlds, ThreadPool& pool);
Intersections intersections_of(const gpu::FrameResult& frame, std::size_t n_worlds);

// Positions of all worlds.
void add_places_of_worlds(Contacts& contacts, Outputs outputs, const Features& features, const Separations& separations,
                          Positions t0, Positions t1, ThreadPool& pool);

}  // namespace hpccd
