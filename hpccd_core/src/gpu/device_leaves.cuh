// SPDX-License-Identifier: Apache-2.0
// The leaves of a hierarchy on the device: which features lie in each, and this frame's boxes of all of them.
#pragma once

#include <vector>

#include "bvh/tree.h"
#include "gpu/launch_params.cuh"
#include "gpu/stream.h"
#include "scene/features.h"

namespace hpccd::gpu {

class DeviceLeaves {
 public:
  // Slots may be padded.
  void set(const Features& features, const std::vector<LeafRange>& leaves, const std::vector<u32>& face_of_slot,
           const std::vector<u32>& edge_of_slot, const std::vector<u32>& vertex_of_slot) {
    n_ = 0;  // none, should anything below fail
    const std::size_t n_edges = features.edges.size(), n_faces = features.faces.size();
    std::vector<DeviceLeaf> packed(leaves.size());
    for (std::size_t i = 0; i < leaves.size(); ++i) {
      const LeafRange& l = leaves[i];
      packed[i] = {l.first_face, l.first_edge, l.first_vertex,
                   DeviceLeaf::counts_of(l.n_faces(), l.n_edges(), l.n_vertices())};
    }
    std::vector<DeviceBox> edge(n_edges), face(n_faces);
    std::vector<u32> corner2(n_faces);
    for (std::size_t s = 0; s < n_edges; ++s) {
      const auto& e = features.edges[edge_of_slot[s]];
      edge[s].tag_low() = e[0], edge[s].tag_high() = e[1];
    }
    for (std::size_t s = 0; s < n_faces; ++s) {
      const auto& corners = features.faces[face_of_slot[s]];
      face[s].tag_low() = corners[0], face[s].tag_high() = corners[1], corner2[s] = corners[2];
    }
    boxes_.reserve(std::max<std::size_t>(leaves.size(), 1));
    kdops_.reserve(std::max<std::size_t>(leaves.size(), 1));
    upload(leaves_, packed.data(), packed.size());
    upload(vertex_of_slot_, vertex_of_slot.data(), features.n_vertices);
    upload(edge_of_slot_, edge_of_slot.data(), n_edges);
    upload(face_of_slot_, face_of_slot.data(), n_faces);
    upload(face_corner2_, corner2.data(), n_faces);
    upload(edge_boxes_, edge.data(), n_edges);
    upload(face_boxes_, face.data(), n_faces);
    n_ = static_cast<u32>(leaves.size());
  }

  u32 size() const { return n_; }

  template <class T>
  void fill(LaunchParams<T>& params) const {
    params.n_leaves = n_, params.leaves = leaves_.data(), params.leaf_boxes = boxes_.data();
    params.leaf_kdops = kdops_.data();
    params.vertex_of_slot = vertex_of_slot_.data(), params.edge_of_slot = edge_of_slot_.data();
    params.face_of_slot = face_of_slot_.data(), params.face_corner2 = face_corner2_.data();
    params.edge_boxes = edge_boxes_.data(), params.face_boxes = face_boxes_.data();
  }

  std::size_t bytes() const {
    return boxes_.bytes() + kdops_.bytes() + edge_boxes_.bytes() + face_boxes_.bytes() + leaves_.bytes() + vertex_of_slot_.bytes() +
           edge_of_slot_.bytes() + face_of_slot_.bytes() + face_corner2_.bytes();
  }

 private:
  u32 n_ = 0;
  DeviceBuffer<DeviceBox> boxes_, edge_boxes_, face_boxes_;
  DeviceBuffer<Kdop> kdops_;
  DeviceBuffer<DeviceLeaf> leaves_;
  DeviceBuffer<u32> vertex_of_slot_, edge_of_slot_, face_of_slot_, face_corner2_;
};

}  // namespace hpccd::gpu
