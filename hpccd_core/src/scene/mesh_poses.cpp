// SPDX-License-Identifier: Apache-2.0
#include "scene/mesh_poses.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

namespace hpccd {
namespace {

// As hpccd_core/rigid/transform.py.
constexpr double length_tolerance = 1e-3;

rigid::Pose checked(const Pose& pose, std::size_t number) {
  const auto finite = [](double x) { return std::isfinite(x); };
  const std::string subject = "poses[" + std::to_string(number) + "]: ";
  if (!std::ranges::all_of(pose.position, finite) || !std::ranges::all_of(pose.quaternion, finite))
    throw InvalidArgument(subject + "is not finite; give a position x y z and a quaternion x y z w");
  const auto [x, y, z, w] = pose.quaternion;
  const double length = std::sqrt(x * x + y * y + z * z + w * w);
  if (!(std::fabs(length - 1) <= length_tolerance)) {
    std::ostringstream text;
    text << subject << "its quaternion has length " << length
         << ", but a rotation has length 1; give x y z w, after the position, and normalise it";
    throw InvalidArgument(text.str());
  }
  return {{x / length, y / length, z / length, w / length}, {pose.position[0], pose.position[1], pose.position[2]}};
}

template <class Real>
void widen(const Real* from, std::size_t n, double* to) {
  std::copy_n(from, n, to);
}

}  // namespace

std::vector<std::uint32_t> posed_meshes(const Scene& scene) {
  std::vector<std::uint32_t> posed;
  for (std::uint32_t m = 0; m < scene.meshes().size(); ++m)
    if (scene.meshes()[m].shape && !scene.meshes()[m].options.is_static) posed.push_back(m);
  return posed;
}

std::vector<rigid::Pose> poses_of_meshes(const Scene& scene, std::span<const Pose> poses, std::size_t worlds) {
  const std::vector<std::uint32_t> posed = posed_meshes(scene);
  if (!poses.empty() && poses.size() != worlds * posed.size())
    throw InvalidArgument("poses: the scene has " + std::to_string(posed.size()) +
                          " meshes with a shape that are not static" +
                          (worlds > 1 ? " in each of " + std::to_string(worlds) + " worlds" : "") + ", but " +
                          std::to_string(poses.size()) + " poses were given; give one for each, in the order added");
  std::vector<rigid::Pose> all(worlds * scene.meshes().size());
  for (std::size_t i = 0; i < poses.size(); ++i)
    all[i / posed.size() * scene.meshes().size() + posed[i % posed.size()]] = checked(poses[i], i);
  return all;
}

std::vector<double> place_meshes(const Scene& scene, std::span<const rigid::Pose> poses, Positions others,
                                 std::size_t worlds, ThreadPool& pool) {
  std::vector<double> all(3 * worlds * std::size_t{scene.n_vertices()});
  std::size_t of_others = 0;
  for (std::size_t world = 0, at = 0; world < worlds; ++world)
    for (std::size_t m = 0; m < scene.meshes().size(); ++m) {
      const Scene::Mesh& mesh = scene.meshes()[m];
      double* to = all.data() + at;
      const std::size_t n = 3 * std::size_t{mesh.n_vertices};
      at += n;
      if (!mesh.shape) {
        if (others.is_double)
          widen(static_cast<const double*>(others.data) + of_others, n, to);
        else
          widen(static_cast<const float*>(others.data) + of_others, n, to);
        of_others += n;
        continue;
      }
      const std::vector<double>& shape = *mesh.shape;
      const rigid::Placing placing(poses[world * scene.meshes().size() + m]);
      parallel_for(pool, mesh.n_vertices, 4096, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t i = 3 * begin; i < 3 * end; i += 3) {
          const rigid::Vector x = placing({shape[i], shape[i + 1], shape[i + 2]});
          to[i] = x.x, to[i + 1] = x.y, to[i + 2] = x.z;
        }
      });
    }
  return all;
}

}  // namespace hpccd
