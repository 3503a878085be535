// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace hpccd::reference {

using Point = std::array<double, 3>;
using Face = std::array<std::uint32_t, 3>;
using Edge = std::array<std::uint32_t, 2>;

struct Scene {
  std::vector<Point> vertices_t0, vertices_t1;
  std::vector<Face> faces;                        // scene-wide vertex indices
  std::vector<std::uint32_t> mesh_of_vertex;      // all vertices of a face lie in one mesh
  std::vector<std::vector<std::uint8_t>> tested;  // tested[a][b]: contacts between meshes a and b are asked for
};

struct Contacts {
  std::vector<std::array<std::uint32_t, 2>> vf;  // vertex, face
  std::vector<double> vf_toc;
  std::vector<std::array<std::uint32_t, 4>> ee;  // a0<a1, b0<b1, (a0,a1)<(b0,b1)
  std::vector<double> ee_toc;
};

// Every vertex, in a face or not, against every face, every edge against every other, unless they share a
// vertex or their meshes are not to be tested. Both lists in lexicographic order.
Contacts brute_force(const Scene& scene, unsigned threads);

}  // namespace hpccd::reference
