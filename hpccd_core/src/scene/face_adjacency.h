// SPDX-License-Identifier: Apache-2.0
// The faces at each vertex and at each edge.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace hpccd {

class FaceAdjacency {
 public:
  using Face = std::array<std::uint32_t, 3>;

  // Keeps a reference to the faces.
  FaceAdjacency(std::span<const Face> faces, std::size_t n_vertices);

  // Ascending.
  std::span<const std::uint32_t> faces_of(std::uint32_t vertex) const {
    return std::span(faces_of_vertex_).subspan(first_[vertex], first_[vertex + 1] - first_[vertex]);
  }
  // Calls use(face) for each face of the edge, in ascending order.
  template <class Use>
  void for_each_face(std::uint32_t v, std::uint32_t w, Use&& use) const {
    const auto of_v = faces_of(v), of_w = faces_of(w);
    const bool v_has_fewer = of_v.size() < of_w.size();  // the other may be the hub of many
    const std::uint32_t other = v_has_fewer ? w : v;
    for (const std::uint32_t face : v_has_fewer ? of_v : of_w) {
      const Face& f = faces_[face];
      if (f[0] == other || f[1] == other || f[2] == other) use(face);
    }
  }

 private:
  std::span<const Face> faces_;
  std::vector<std::uint32_t> first_, faces_of_vertex_;
};

}  // namespace hpccd
