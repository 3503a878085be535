// SPDX-License-Identifier: Apache-2.0
// The leaves of a hierarchy on the device: the features in each leaf, and their boxes of this frame in each world.
#pragma once

#include <algorithm>
#include <vector>

#include "bvh/tree.h"
#include "gpu/launch_params.cuh"
#include "gpu/stream.h"
#include "scene/features.h"

namespace hpccd::gpu {

class DeviceLeaves {
 public:
  explicit DeviceLeaves(u32 n_worlds) : n_worlds_(n_worlds) {}

  // Slots may be padded.
  void set(const Features& features, const std::vector<LeafRange>& leaves, const std::vector<u32>& face_of_slot,
           const std::vector<u32>& edge_of_slot, const std::vector<u32>& vertex_of_slot) {
    n_ = 0;  // no leaves, if anything below fails
    std::vector<DeviceLeaf> packed;
    std::vector<u32> corners;
    std::vector<LeafFeature> edges(features.edges.size()), faces(features.faces.size());
    packed.reserve(leaves.size());
    for (const LeafRange& l : leaves) {
      const auto first_corner = static_cast<u32>(corners.size());
      const auto place = [&](u32 vertex) {
        const auto at = std::find(corners.begin() + first_corner, corners.end(), vertex);
        const auto k = static_cast<u32>(at - corners.begin()) - first_corner;
        if (at == corners.end()) corners.push_back(vertex);
        return k;
      };
      for (u32 s = l.first_vertex; s < l.end_vertex; ++s) corners.push_back(vertex_of_slot[s]);
      for (u32 s = l.first_face; s < l.end_face; ++s) {
        const auto& f = features.faces[face_of_slot[s]];
        const u32 a = place(f[0]), b = place(f[1]), c = place(f[2]);
        faces[s] = {face_of_slot[s], a | b << 8 | c << 16};
      }
      for (u32 s = l.first_edge; s < l.end_edge; ++s) {
        const auto& e = features.edges[edge_of_slot[s]];
        const u32 a = place(e[0]), b = place(e[1]);
        edges[s] = {edge_of_slot[s], a | b << 8};
      }
      const auto n_corners = static_cast<u32>(corners.size()) - first_corner;
      packed.push_back({first_corner, l.first_edge, l.first_face,
                        DeviceLeaf::counts_of(n_corners, l.n_edges(), l.n_faces(), l.n_vertices())});
    }
    const std::size_t boxes = std::max<std::size_t>(leaves.size() * n_worlds_, 1);
    boxes_.reserve(boxes);
    kdops_.reserve(boxes);
    upload(leaves_, packed.data(), packed.size());
    upload(corners_, corners.data(), corners.size());
    upload(edges_, edges.data(), edges.size());
    upload(faces_, faces.data(), faces.size());
    n_ = static_cast<u32>(leaves.size());
  }

  u32 size() const { return n_; }

  template <class T>
  void fill(LaunchParams<T>& params) const {
    params.n_leaves = n_;
    params.by_leaves = n_worlds_ > 1 ? Division::by(n_) : Division{0};
    params.leaves = leaves_.data(), params.corners = corners_.data();
    params.leaf_edges = edges_.data(), params.leaf_faces = faces_.data();
    params.leaf_boxes = boxes_.data(), params.leaf_kdops = kdops_.data();
  }

  std::size_t bytes() const {
    return boxes_.bytes() + kdops_.bytes() + leaves_.bytes() + corners_.bytes() + edges_.bytes() + faces_.bytes();
  }

 private:
  const u32 n_worlds_;
  u32 n_ = 0;
  DeviceBuffer<DeviceLeaf> leaves_;
  DeviceBuffer<u32> corners_;
  DeviceBuffer<LeafFeature> edges_, faces_;
  DeviceBuffer<DeviceBox> boxes_;
  DeviceBuffer<Kdop> kdops_;
};

}  // namespace hpccd::gpu
