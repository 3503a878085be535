// SPDX-License-Identifier: Apache-2.0
// All results of a scene, by exact tests of every pair whose boxes overlap.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "all_pairs.h"

namespace oracle {

// Both lists in lexicographic order. Values: times, or distances.
struct Pairs {
  std::vector<std::array<std::uint32_t, 2>> vf;  // vertex, face
  std::vector<double> vf_value;
  std::vector<std::array<std::uint32_t, 4>> ee;  // a0<a1, b0<b1, (a0,a1)<(b0,b1)
  std::vector<double> ee_value;
};

// For each pair of meshes a distance; 0 is plain contact.
using Separations = std::vector<std::vector<double>>;

// Contacts of a step: every vertex against every face, every edge against every other.
Pairs contacts(const Meshes& meshes, const std::vector<Point>& t0, const std::vector<Point>& t1,
               const Separations& separations, unsigned threads);

// The same for one frame: pairs within the distance, with the rounded distances.
Pairs proximity(const Meshes& meshes, const std::vector<Point>& vertices, double distance, unsigned threads);

// Every edge against every face: two vertices, face.
std::vector<std::array<std::uint32_t, 3>> intersections(const Meshes& meshes, const std::vector<Point>& vertices,
                                                        unsigned threads);

struct Gap {
  std::uint32_t mesh_a, mesh_b;
  double distance;  // +inf where there is no pair of features
  bool intersect;   // an edge of one and a face of the other share a point; the distance is 0
};

// The smallest distance of each two meshes that are tested, mesh_a <= mesh_b.
std::vector<Gap> smallest_distances(const Meshes& meshes, const std::vector<Point>& vertices, unsigned threads);

}  // namespace oracle
