// SPDX-License-Identifier: Apache-2.0
// Pairs that a frame on the GPU leaves to the CPU, where their vertices are in the caller's arrays.
#pragma once

#include <optional>
#include <vector>

#include "backends/gpu_contacts.h"
#include "elementary/distance/separations.h"
#include "elementary/fallback.h"
#include "hpccd/hpccd.h"

namespace hpccd {

Vec3<double> position(Positions p, std::uint32_t vertex);

UndecidedPair undecided_pair(const Features& features, const Separations& separations, const Candidate& pair,
                             Positions t0, Positions t1);

// Of an edge and a face: both ends, then the corners.
void edge_face_positions(const Features& features, const Candidate& pair, Positions vertices, Vec3<double> q[5]);

// Those that have a time or a distance, in canonical order.
DecidedContacts decided_contacts(const std::vector<Candidate>& pairs, const std::vector<std::optional<double>>& values);

}  // namespace hpccd
