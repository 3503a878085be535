// SPDX-License-Identifier: Apache-2.0
// The poses of meshes with a shape, and the positions that follow from them.
#pragma once

#include <span>
#include <vector>

#include "base/parallel.h"
#include "hpccd/hpccd.h"
#include "rigid/pose.h"

namespace hpccd {

// The meshes that have a pose: those with a shape that are not static, in the order added. By number.
std::vector<std::uint32_t> posed_meshes(const Scene& scene);

// By mesh: its pose, the identity where it has none. `poses`: of the posed meshes of each of `worlds`, or empty: the
// identity. Throws InvalidArgument if their number is another one, or if a pose is invalid.
std::vector<rigid::Pose> poses_of_meshes(const Scene& scene, std::span<const Pose> poses, std::size_t worlds = 1);

// The positions of all vertices of all worlds, x y z: those of meshes with a shape by the poses of meshes (world by
// world), the others from `others`, which has them in their order.
std::vector<double> place_meshes(const Scene& scene, std::span<const rigid::Pose> poses_of_meshes, Positions others,
                                 std::size_t worlds, ThreadPool& pool);

}  // namespace hpccd
