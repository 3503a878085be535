// SPDX-License-Identifier: Apache-2.0
#include "scene/tested_pairs.h"

namespace hpccd {

TestedPairs::TestedPairs(const Scene& scene) : not_ignored_(scene.meshes().size(), true) {
  const auto n = static_cast<std::uint32_t>(scene.meshes().size());
  std::size_t n_moving = 0, n_planes = 0;
  for (const Scene::Mesh& mesh : scene.meshes()) {
    const MeshOptions& o = mesh.options;
    meshes_.push_back(static_cast<unsigned char>((o.is_static ? is_static : 0) | (o.self_collision ? within : 0) |
                                                 (mesh.plane ? is_plane : 0)));
    n_planes += mesh.plane.has_value();
    n_moving += !o.is_static && !mesh.plane;
  }
  for (std::uint32_t a = 0; a < n; ++a) {
    const bool moves = !(meshes_[a] & is_static), itself = by_meshes(a, a);
    n_with_.push_back(meshes_[a] & is_plane ? 0 : (moves ? n - n_planes - 1 : n_moving) + itself);
    n_pairs_ += n_with_[a] + itself;  // each pair of two meshes is counted twice so far
  }
  n_pairs_ /= 2;
  for (const auto& [pair, ignored] : ScenePairs(scene).ignored()) {
    const auto [a, b] = pair;
    not_ignored_.set(a, b, false);
    if (!by_meshes(a, b)) continue;
    --n_pairs_, --n_with_[a];
    if (a != b) --n_with_[b];
  }
  if (not_ignored_.has_all())
    for (std::uint32_t a = 0; a < n; ++a)
      for (std::uint32_t b = 0; b <= a; ++b)
        if (!by_meshes(a, b)) not_ignored_.set(a, b, false);
  all_ = n_pairs_ == (n - n_planes) * (n - n_planes + 1) / 2;
}

}  // namespace hpccd
