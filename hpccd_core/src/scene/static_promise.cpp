// SPDX-License-Identifier: Apache-2.0
#include "scene/static_promise.h"

#include <cstring>

namespace hpccd {
namespace {

template <class Real>
void require_rest(const Scene::Mesh& mesh, const Real* t0, const Real* t1) {
  const std::size_t begin = 3 * std::size_t{mesh.first_vertex}, n = 3 * std::size_t{mesh.n_vertices};
  if (std::memcmp(t0 + begin, t1 + begin, n * sizeof(Real)) == 0) return;
  for (std::size_t i = begin; i < begin + n; ++i)
    // 0 and -0 differ in bits only; NaN is reported where all coordinates are checked.
    if (t0[i] < t1[i] || t0[i] > t1[i])
      throw InvalidArgument("vertices_t1[" + std::to_string(i / 3) + "]: moves, but it belongs to mesh '" + mesh.name +
                            "', which was added as static; add the mesh without static=True, or keep its vertices");
}

}  // namespace

void require_static_meshes_rest(const Scene& scene, Positions t0, Positions t1) {
  for (const Scene::Mesh& mesh : scene.meshes()) {
    if (!mesh.options.is_static) continue;
    if (t0.is_double)
      require_rest(mesh, static_cast<const double*>(t0.data), static_cast<const double*>(t1.data));
    else
      require_rest(mesh, static_cast<const float*>(t0.data), static_cast<const float*>(t1.data));
  }
}

}  // namespace hpccd
