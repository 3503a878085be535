// SPDX-License-Identifier: Apache-2.0
// Which contacts or near pairs get points, normals and nearest points, and where to. All pointers are to memory that
// the device reaches.
#pragma once

#include "contacts/pair_places.h"
#include "gpu/counters.cuh"

namespace hpccd::gpu {

// Rows as on the host: the vertex-face pairs, then the others. Lists that nobody asked for may be null.
struct PlacesTask {
  u64 n_vf, n_ee;
  const uint2* vf;           // vertex, face
  const uint2* ee_features;  // numbers of edges
  const double* tocs;        // of all rows; not read where the outputs are for the start
  Outputs outputs;
  double *points, *normals;  // three a row
  double* closest;           // six a row
  // Rows that only integers can tell: left as they are, for the host. Counts on where the capacity is exceeded.
  u64* open_rows;
  u64 open_capacity;
  u64* n_open;
};

}  // namespace hpccd::gpu
