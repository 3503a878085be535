// SPDX-License-Identifier: Apache-2.0
#include "paper/hierarchy.h"

#include <algorithm>
#include <numeric>

#include "scene/pair_rules.h"

namespace hpccd::paper {
namespace {

// Twice the centre: only the order matters.
float center(const Box& b, int axis) { return b.low[axis] + b.high[axis]; }

struct CenterBounds {
  float low[3] = {Box::inf, Box::inf, Box::inf}, high[3] = {-Box::inf, -Box::inf, -Box::inf};
  void include(const Box& b) {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], center(b, k));
      high[k] = std::max(high[k], center(b, k));
    }
  }
  int widest_axis() const {
    int axis = 0;
    for (int k = 1; k < 3; ++k)
      if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
    return axis;
  }
};

// Moves the lower half along the widest axis to the front; ties are broken by number, so that the result is the same on
// every machine.
void median(std::uint32_t* items, std::uint32_t n, std::uint32_t half, const std::vector<Box>& boxes,
            const Cancellation& cancellation) {
  CenterBounds bounds;
  for (std::uint32_t i = 0; i < n; ++i) bounds.include(boxes[items[i]]);
  const int axis = bounds.widest_axis();
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    const float xa = center(boxes[a], axis), xb = center(boxes[b], axis);
    return xa < xb || (xa == xb && a < b);
  };
  constexpr std::uint32_t many = 1 << 14;
  if (n < many)
    std::nth_element(items, items + half, items + n, before);
  else
    std::nth_element(items, items + half, items + n, heeding(cancellation, before));
}

}  // namespace

void Hierarchy::start(const Features& features) {
  nodes.clear();
  order.resize(features.n_primitives());
  std::iota(order.begin(), order.end(), 0);
  if (order.empty()) return;
  resize(nodes, 2 * order.size() - 1, *cancellation_);
  make_child(0, 0, features.n_primitives(), features);
}

void Hierarchy::split(NodeIndex n, const Features& features) {
  cancellation_->heed();
  const Node node = nodes[n];
  std::uint32_t left_count;
  if (node.mesh == mixed_meshes) {
    left_count = split_meshes(node, features);
  } else {
    left_count = (node.count + 1) / 2;
    median(order.data() + node.begin, node.count, left_count, primitive_boxes, *cancellation_);
  }
  make_child(left(n), node.begin, left_count, features);
  cancellation_->heed();
  make_child(right(n), node.begin + left_count, node.count - left_count, features);
  nodes[n].is_split = true;
  nodes[n].culling_when_split = culling_inefficiency(*this, n);
}

std::uint32_t Hierarchy::split_meshes(const Node& node, const Features& features) {
  std::vector<Box> mesh_boxes;
  std::vector<std::uint32_t> meshes;
  const auto first = order.begin() + node.begin, last = first + node.count;
  for (auto c = first; c != last; ++c) {
    const std::uint32_t mesh = features.mesh_of_primitive[*c];
    if (mesh >= mesh_boxes.size()) mesh_boxes.resize(mesh + 1);
    if (mesh_boxes[mesh].low[0] > mesh_boxes[mesh].high[0]) meshes.push_back(mesh);
    mesh_boxes[mesh].include(primitive_boxes[*c]);
  }
  const auto half = static_cast<std::uint32_t>(meshes.size() / 2);
  median(meshes.data(), static_cast<std::uint32_t>(meshes.size()), half, mesh_boxes, *cancellation_);
  std::vector<char> goes_left(mesh_boxes.size(), 0);
  for (std::uint32_t i = 0; i < half; ++i) goes_left[meshes[i]] = 1;
  const auto middle =
      std::partition(first, last, [&](std::uint32_t c) { return goes_left[features.mesh_of_primitive[c]] != 0; });
  return static_cast<std::uint32_t>(middle - first);
}

void Hierarchy::make_child(NodeIndex n, std::uint32_t begin, std::uint32_t count, const Features& features) {
  Node node;
  node.begin = begin;
  node.count = count;
  node.mesh = features.mesh_of_primitive[order[begin]];
  for (std::uint32_t i = begin; i < begin + count; ++i) {
    node.box.include(primitive_boxes[order[i]]);
    if (features.mesh_of_primitive[order[i]] != node.mesh) node.mesh = mixed_meshes;
  }
  nodes[n] = node;
}

std::size_t Hierarchy::bytes() const {
  return nodes.capacity() * sizeof(Node) + order.capacity() * sizeof(order[0]) +
         primitive_boxes.capacity() * sizeof(Box);
}

float culling_inefficiency(const Hierarchy& h, NodeIndex n) {
  const float whole = h.nodes[n].box.half_area();
  const float parts = h.nodes[Hierarchy::left(n)].box.half_area() + h.nodes[h.right(n)].box.half_area();
  return whole > 0 ? parts / whole : 1;
}

}  // namespace hpccd::paper
