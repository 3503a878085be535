// SPDX-License-Identifier: Apache-2.0
#include "scene/face_adjacency.h"

#include <numeric>

namespace hpccd {
namespace {

// Calls use(corner) once for each vertex of the face.
template <class Use>
void for_each_corner(const FaceAdjacency::Face& f, Use&& use) {
  use(f[0]);
  if (f[1] != f[0]) use(f[1]);
  if (f[2] != f[0] && f[2] != f[1]) use(f[2]);
}

}  // namespace

FaceAdjacency::FaceAdjacency(std::span<const Face> faces, std::size_t n_vertices)
    : faces_(faces), first_(n_vertices + 2, 0) {
  // The counts lie two places after their vertex, so that filling moves each begin to where it belongs.
  for (const Face& f : faces) for_each_corner(f, [&](std::uint32_t v) { ++first_[v + 2]; });
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  faces_of_vertex_.resize(first_.back());
  for (std::uint32_t i = 0; i < faces.size(); ++i)
    for_each_corner(faces[i], [&](std::uint32_t v) { faces_of_vertex_[first_[v + 1]++] = i; });
}

}  // namespace hpccd
