// SPDX-License-Identifier: Apache-2.0
#include "scene/static_meshes.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>

#include "base/coordinate_limits.h"

namespace hpccd {
namespace {

bool is_valid(double x) { return std::fabs(x) <= largest_coordinate; }

template <class Real>
void require_rest(const Scene::Mesh& mesh, const Real* t0, const Real* t1) {
  const std::size_t begin = 3 * std::size_t{mesh.first_vertex}, n = 3 * std::size_t{mesh.n_vertices};
  if (std::memcmp(t0 + begin, t1 + begin, n * sizeof(Real)) == 0) return;
  for (std::size_t i = begin; i < begin + n; ++i)
    // 0 and -0 differ only in their bits; invalid coordinates are reported when all are checked.
    if ((t0[i] < t1[i] || t0[i] > t1[i]) && is_valid(t0[i]) && is_valid(t1[i]))
      throw InvalidArgument(
          "vertices_t1[" + std::to_string(i / 3) + "]: moves, but it belongs to mesh '" + mesh.name +
          "', which was added as static; give positions at the end, not displacements, with its vertices unchanged (in "
          "both arrays the meshes in the order added, and one dtype), or add it as one that moves");
}

// Bytes of this number of vertices, in the precision of p.
std::size_t bytes_of(std::uint32_t vertices, Positions p) { return 3 * std::size_t{vertices} * (p.is_double ? 8 : 4); }

const std::byte* begin_of(const Scene::Mesh& mesh, Positions p) {
  return static_cast<const std::byte*>(p.data) + bytes_of(mesh.first_vertex, p);
}

bool equal(const std::vector<std::byte>& last, const std::byte* t0, const std::byte* t1, ThreadPool& pool) {
  std::atomic<bool> same{true};
  parallel_for(pool, last.size(), 1 << 16, [&](std::size_t begin, std::size_t end, int) {
    if (std::memcmp(&last[begin], t0 + begin, end - begin) != 0 ||
        std::memcmp(&last[begin], t1 + begin, end - begin) != 0)
      same = false;
  });
  return same;
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

std::vector<char> StaticMeshes::unchanged(const Scene& scene, Positions t0, Positions t1, ThreadPool& pool) {
  const auto& meshes = scene.meshes();
  std::vector<char> same(meshes.size(), 0);
  last_.resize(meshes.size());
  bool any_moved = false;
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    if (!meshes[m].options.is_static) continue;
    same[m] = last_[m].size() == bytes_of(meshes[m].n_vertices, t0) &&
              equal(last_[m], begin_of(meshes[m], t0), begin_of(meshes[m], t1), pool);
    any_moved = any_moved || !same[m];
  }
  if (!any_moved) return same;
  require_static_meshes_rest(scene, t0, t1);
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    if (!meshes[m].options.is_static || same[m]) continue;
    const std::byte* all = begin_of(meshes[m], t0);
    resize(last_[m], bytes_of(meshes[m].n_vertices, t0), pool.cancellation());
    parallel_for(pool, last_[m].size(), 1 << 16,
                 [&](std::size_t begin, std::size_t end, int) { std::copy(all + begin, all + end, &last_[m][begin]); });
    // If both ends differ only in signs of zeros, boxes and points have the sign of one of them: the next frame starts
    // from scratch.
    if (!equal(last_[m], all, begin_of(meshes[m], t1), pool)) last_[m].clear();
  }
  return same;
}

std::size_t StaticMeshes::bytes() const {
  std::size_t n = 0;
  for (const auto& mesh : last_) n += mesh.capacity();
  return n;
}

}  // namespace hpccd
