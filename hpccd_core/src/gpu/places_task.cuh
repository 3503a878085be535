// SPDX-License-Identifier: Apache-2.0
// The rows for which points, normals and nearest points are requested, and the output arrays. All pointers are to
// device memory.
#pragma once

#include "contacts/pair_places.h"
#include "gpu/places.h"
#include "gpu/stages.cuh"

namespace hpccd::gpu {

// Where places go; what nobody asked for may be null.
struct PlacesOut {
  Outputs outputs;
  double *points, *normals;  // three a row
  double* closest;           // six a row
};

struct PlacesTask {
  u64 n_vf, n_ee;
  const uint2* vf;
  const uint4* ee;
  const double* tocs;                  // of the vertex-face pairs, then of the others
  const u64 *vf_offsets, *ee_offsets;  // of several worlds
  PlacesOut out;
  // Rows that only integers can tell; of these, the ones that integers of a fixed size cannot. Counted on where there
  // is no more room.
  OpenRow *open, *to_host;
  u64 open_capacity;  // of both
  u64* n_open;        // of both
};

// Defined for float and double.
template <class T>
void launch_places(const LaunchParams<T>& params, const PlacesTask& task, const Stages& stages);
// Of the rows that those leave open.
void launch_places_in_integers(const PlacesTask& task, const Stages& stages);
// places[i]: of the row open[i].
void launch_put(const PlacesOut& out, const OpenRow* open, const PairPlaces* places, u64 n, const Stages& stages);

}  // namespace hpccd::gpu
