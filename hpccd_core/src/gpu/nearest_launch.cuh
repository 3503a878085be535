// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gpu/nearest_task.cuh"
#include "gpu/stages.cuh"

namespace hpccd::gpu {

// The nearest features of all pairs of meshes, once the boxes of the frame are known. Defined for float and double.
template <class T>
void launch_nearest(const LaunchParams<T>& params, const NearestTask& task, u32 levels, bool within_meshes,
                    const Stages& stages);

// Winding numbers of vertices in the same frame.
template <class T>
void launch_inside(const LaunchParams<T>& params, const InsideTask& task, const Stages& stages);

}  // namespace hpccd::gpu
