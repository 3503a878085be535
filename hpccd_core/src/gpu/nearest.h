// SPDX-License-Identifier: Apache-2.0
// The nearest features of pairs of meshes, as the device returns them.
#pragma once

#include <vector>

#include "base/hd.h"
#include "base/vec3.h"
#include "elementary/motion.h"
#include "gpu/counters.cuh"

namespace hpccd::gpu {

// A pair of features, numbered in its world, and the positions of its vertices in the order of the elementary tests.
struct PairOfFeatures {
  u32 first, second;
  Kind kind;
  Vec3<double> at[5];
};

// A pair of meshes to be searched, and the largest thickness of two of their features (NearestPairs::lack).
struct PairToSearch {
  u32 mesh_a, mesh_b;
  bool filtered;  // some pairs of features are ignored
  double thickest, most_lack;
};

// The nearest pair of two meshes in one world that the device could decide.
struct NearestOfMeshes {
  PairOfFeatures pair;
  bool found;
  double distance;           // with the lack (traverse/nearest_pairs.h)
  double without_thickness;  // of the centre surfaces
  double limit;              // undecided pairs beyond it, with their lack, do not matter
  // Whether the boxes of both meshes overlap, and whether that of a is within that of b, or that of b within that of a.
  bool boxes_meet, a_within_b, b_within_a;
};

// A pair that only integers can decide: it may be nearer. `of`: the pair of meshes, numbered through all worlds.
struct UndecidedNearest {
  u32 of;
  PairOfFeatures pair;
};

// A vertex of a world, and a closed mesh that may contain it.
struct VertexInMesh {
  u32 world, vertex, mesh;
};

struct NearestPairsFound {
  bool good = true;                        // all coordinates are finite and not too large
  bool gave_up = false;                    // boxes leave too many pairs of leaves
  std::vector<NearestOfMeshes> of_meshes;  // world by world
  std::vector<UndecidedNearest> undecided;
};

}  // namespace hpccd::gpu
