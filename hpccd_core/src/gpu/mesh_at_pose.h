// SPDX-License-Identifier: Apache-2.0
// The device's copy of meshes at poses: boxes of nodes in the frame of their mesh, and the maps of boxes and vertices
// into the scene. Bounds and positions are bit-identical to those of bvh/placed_meshes.h.
#pragma once

#include <cstdint>
#include <cstring>

#include "base/hd.h"
#include "bvh/placed_meshes.h"
#include "rigid/pose.h"

namespace hpccd::gpu {

// The box of a node in the frame of its mesh.
struct alignas(16) LocalBox {
  float low[3];
  std::uint32_t mesh;
  float high[3];
  std::uint32_t unused;
};

// Four floats that are loaded at once.
struct alignas(16) Row {
  float x[4];

  HPCCD_HD static Row load(const Row* at) {
#if defined(__CUDA_ARCH__)
    const float4 v = __ldg(reinterpret_cast<const float4*>(at));
    return {{v.x, v.y, v.z, v.w}};
#else
    return *at;
#endif
  }
};

// One mesh. Rows for the axes, then as many for the slanted directions: the columns of the rotation, of the extents,
// and the shift, with the margin as the fourth number (PlacedMeshes::Placed).
struct MeshAtPose {
  static constexpr int rows_of_end = 7;
  Row rows[2 * rows_of_end];
  rigid::Placing placing{{}};

  static MeshAtPose of(const PlacedMeshes::Placed& mesh) {
    MeshAtPose m;
    m.placing = mesh.placing;
    const auto put = [&](int end, const Floats4* axes, const Floats4* extents, Floats4 shift, Floats4 margin) {
      Row* to = m.rows + end * rows_of_end;
      for (int j = 0; j < 3; ++j)
        std::memcpy(to + j, axes + j, sizeof *to), std::memcpy(to + 3 + j, extents + j, sizeof *to);
      std::memcpy(to + 6, &shift, sizeof *to);
      to[6].x[3] = margin[0];
    };
    put(0, mesh.axes, mesh.extents, mesh.shift, mesh.margin);
    put(1, mesh.slanted_axes, mesh.slanted_extents, mesh.slanted_shift, mesh.slanted_margin);
    return m;
  }
};

// Bounds along the axes and along the slanted directions.
struct BoundsAtPose {
  float low[2][3], high[2][3];
};

// Those of PlacedMeshes::at_pose.
HPCCD_HD BoundsAtPose bounds_at(const MeshAtPose* mesh, const LocalBox& box) {
  BoundsAtPose r;
  for (int end = 0; end < 2; ++end) {
    const Row* rows = mesh->rows + end * MeshAtPose::rows_of_end;
    const Row shift = Row::load(rows + 6);
    float center[3], half[3];
    for (int k = 0; k < 3; ++k) center[k] = shift.x[k], half[k] = shift.x[3];
    for (int j = 0; j < 3; ++j) {
      const Row axis = Row::load(rows + j), extent = Row::load(rows + 3 + j);
      const float c = 0.5f * (box.low[j] + box.high[j]), h = 0.5f * (box.high[j] - box.low[j]);
      for (int k = 0; k < 3; ++k) center[k] += axis.x[k] * c, half[k] += extent.x[k] * h;
    }
    for (int k = 0; k < 3; ++k) r.low[end][k] = center[k] - half[k], r.high[end][k] = center[k] + half[k];
  }
  return r;
}

}  // namespace hpccd::gpu
