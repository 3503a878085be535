// SPDX-License-Identifier: Apache-2.0
// The public result of a step on the GPU: the contacts of the device, sorted and hashed, together with those that the
// CPU decided.
#pragma once

#include <optional>
#include <vector>

#include "base/parallel.h"
#include "contacts/places.h"
#include "elementary/distance/separations.h"
#include "elementary/fallback.h"
#include "gpu/pipeline.h"
#include "hpccd/hpccd.h"
#include "scene/features.h"

namespace hpccd {

// Pairs that a frame leaves to the CPU, with vertices from the caller's arrays.
UndecidedPair undecided_pair(const Features& features, const Separations& separations, const Candidate& pair,
                             Positions t0, Positions t1);
// For an edge and a face: both ends, then the corners.
void edge_face_positions(const Features& features, const Candidate& pair, Positions vertices, Vec3<double> q[5]);

// In canonical order.
struct DecidedContacts {
  std::vector<Contact> vertex_face, edge_edge;
};
// The pairs that have a time or a distance.
DecidedContacts decided_contacts(const std::vector<Candidate>& pairs, const std::vector<std::optional<double>>& values);

Contacts join(const gpu::FrameResult& device, const DecidedContacts& decided, const Features& features,
              ThreadPool& pool);
// For edges and faces, which the pipeline numbers as vertices and faces.
Intersections join_intersections(const gpu::FrameResult& device, const DecidedContacts& decided,
                                 const Features& features);

// The results of a frame of many worlds, from page-locked memory.
Contacts contacts_of(const gpu::FrameResult& frame, std::size_t n_worlds, ThreadPool& pool);
Intersections intersections_of(const gpu::FrameResult& frame, std::size_t n_worlds);

// The device finds all contacts: drops those that are not requested.
void reduce(Contacts& contacts, Report report);

// Positions of one world, or of all.
void add_places(Contacts& contacts, Outputs outputs, const Features& features, const Separations& separations,
                Positions t0, Positions t1, ThreadPool& pool);
void add_places_of_worlds(Contacts& contacts, Outputs outputs, const Features& features, const Separations& separations,
                          Positions t0, Positions t1, ThreadPool& pool);

}  // namespace hpccd
