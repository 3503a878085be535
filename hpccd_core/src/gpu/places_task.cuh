// SPDX-License-Identifier: Apache-2.0
// The rows for which outputs are requested, and the output arrays. All pointers are to
// device memory.
#pragma once

#include "contacts/pair_places.h"
#include "gpu/places.h"
#include "gpu/stages.cuh"

namespace hpccd::gpu {

// Output arrays; those that are not requested may be null.
struct PlacesOut {
  Outputs outputs;
  double *points, *normals;  // three per row
  double* closest;           // six per row
  uint4* vertices;
  double* weights;  // four per row
  double* approach;
};

struct PlacesTask {
  const u64* n_rows;  // vertex-face pairs, and the others
  const uint2* vf;
  const uint4* ee;
  const double* tocs;                  // of the vertex-face pairs, then of the others
  const u64 *vf_offsets, *ee_offsets;  // for several worlds
  PlacesOut out{};
  // Rows that only integers can decide; and among these, rows that fixed-size integers cannot. Counters continue beyond
  // the capacity.
  OpenRow *open, *to_host;
  u64 open_capacity;  // of both
  u64* n_open;        // of both
};

// Defined for float and double.
template <class T>
void launch_places(const LaunchParams<T>& params, const PlacesTask& task, const Stages& stages);
// For the rows that those leave open.
void launch_places_in_integers(const PlacesTask& task, const Stages& stages);
// places[i] belongs to the row open[i].
void launch_put(const PlacesOut& out, const OpenRow* open, const PairPlaces* places, u64 n, const Stages& stages);

}  // namespace hpccd::gpu
