// SPDX-License-Identifier: Apache-2.0
#include "bvh/placed_meshes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "base/active_wait.h"
#include "base/coordinate_limits.h"
#include "scene/edge_sample.h"

namespace hpccd {
namespace {

// Rounding errors of bounds at a pose, in coordinates of the boxes. Centres and half extents are within 3.9 of zero (a
// mesh is at most the root of three times as long in its own frame as along the axes), and so are their sums over three
// axes. Rounding numbers to floats, products and sums of both: at most 4.9e-6. Along a slanted direction all are twice
// as large.
constexpr float axis_margin = 8e-6f, slanted_margin = 2e-5f;

// Calls f once of all threads, unless the state is `fitted` already; returns when it is.
template <class F>
void once(std::uint32_t& state, std::uint32_t fitted, F&& f) {
  const std::atomic_ref at(state);
  std::uint32_t seen = at.load(std::memory_order_acquire);
  if (seen == fitted) return;
  if (seen != fitted - 1 && at.compare_exchange_strong(seen, fitted - 1, std::memory_order_acquire)) {
    f();
    at.store(fitted, std::memory_order_release);
    return;
  }
  for (ActiveWait wait; at.load(std::memory_order_acquire) != fitted;) wait.turn();
}

// Bit by bit: the sign of a zero in a pose decides that of a coordinate.
bool same(const rigid::Pose& a, const rigid::Pose& b) {
  static_assert(sizeof a == 7 * sizeof(double));
  return memcmp(&a, &b, sizeof a) == 0;
}

bool turns(const rigid::Pose& pose) { return rigid::any({pose.turn.x, pose.turn.y, pose.turn.z}); }

// By rows.
void matrix_of(const rigid::Pose& pose, double (&m)[3][3]) {
  const rigid::Rotation r = turns(pose) ? rigid::rotation_of(pose.turn) : rigid::rotation_of({});
  const rigid::Vector rows[3] = {r.first, r.second, r.third};
  for (int i = 0; i < 3; ++i) m[i][0] = rows[i].x, m[i][1] = rows[i].y, m[i][2] = rows[i].z;
}

Floats4 all(float x) { return Floats4{x, x, x, x}; }

}  // namespace

PlacedMeshes::PlacedMeshes(const Scene& scene, const Features& features, ThreadPool& pool)
    : scene_(scene), features_(features), pool_(pool) {
  measure();
}

// What does not depend on the poses.
void PlacedMeshes::measure() {
  finest_ = std::numeric_limits<double>::infinity();
  for (const Scene::Mesh& m : scene_.meshes()) {
    Placed& mesh = meshes_.emplace_back();
    const std::span shape = m.shape ? std::span<const double>(*m.shape) : std::span<const double>();
    mesh.shape = shape.data(), mesh.first_vertex = m.first_vertex;
    double size = 0;
    for (std::size_t i = 0; i < shape.size(); ++i) {
      const double x = shape[i];
      mesh.local.low[i % 3] = std::min(mesh.local.low[i % 3], x);
      mesh.local.high[i % 3] = std::max(mesh.local.high[i % 3], x);
      mesh.largest = std::max(mesh.largest, std::fabs(x));
    }
    if (m.n_vertices == 0) continue;
    for (int k = 0; k < 3; ++k) {
      mesh.center[k] = 0.5 * mesh.local.low[k] + 0.5 * mesh.local.high[k];
      size = std::max(size, mesh.local.high[k] - mesh.local.low[k]);
    }
    const int exponent = size > 0 ? std::ilogb(size) : 0;
    mesh.scale = std::ldexp(1.0, -std::clamp(exponent, -1000, 1000));
    const auto n = static_cast<double>(m.n_vertices);
    if (size > 0 && n * n >= 64.0 * features_.n_vertices) finest_ = std::min(finest_, size / std::sqrt(n));
  }
  const double edge = short_edge(features_.edges, edges_of_a_step, [&](std::uint32_t from, std::uint32_t to) {
    const Placed& mesh = meshes_[features_.mesh_of_vertex[from]];
    const double *a = mesh.shape + 3 * std::size_t{from - mesh.first_vertex},
                 *b = mesh.shape + 3 * std::size_t{to - mesh.first_vertex};
    return std::max({std::fabs(a[0] - b[0]), std::fabs(a[1] - b[1]), std::fabs(a[2] - b[2])});
  });
  if (edge > 0) finest_ = std::min(finest_, edge);
}

// With each mesh turned as in its own frame, where its boxes will be, but at its place in the scene: so that meshes
// that are near each other are so in the tree.
void PlacedMeshes::build_tree() {
  const std::size_t n = features_.n_vertices;
  {
    std::vector<double> x(3 * n);
    for (const Placed& mesh : meshes_) {
      const std::size_t m = static_cast<std::size_t>(&mesh - meshes_.data());
      const rigid::Vector at = mesh.placing({mesh.center[0], mesh.center[1], mesh.center[2]});
      const double by[3] = {at.x - mesh.center[0], at.y - mesh.center[1], at.z - mesh.center[2]};
      const std::size_t numbers = 3 * std::size_t{scene_.meshes()[m].n_vertices};
      for (std::size_t i = 0; i < numbers; ++i) x[3 * std::size_t{mesh.first_vertex} + i] = mesh.shape[i] + by[i % 3];
    }
    MotionBounds at_rest;
    at_rest.features = &features_;
    const Positions positions = Positions::of(x);
    at_rest.update(positions, positions, pool_);
    build(tree_, scene_, features_, at_rest, pool_);
  }
  // Only searches of motions use them.
  tree_.kdops = {}, tree_.by_kdops = false, tree_.bent = false;
  tree_.blocks = {}, tree_.block_of_leaf = {};
  find_least_edges(tree_);
  fit_local_boxes();
  for (std::uint32_t i = 0; i < std::min(tree_.nodes.size(), 2 * meshes_.size()); ++i)  // the first ones, breadth first
    if (tree_.nodes[i].mesh == mixed_meshes) mixed_.push_back(i);
  resize(snapshot_.vertices, n, pool_.cancellation());
  vertex_state_.assign(n, 0), leaf_state_.assign(tree_.leaves.size(), 0);
  built_ = true;
}

void PlacedMeshes::fit_local_boxes() {
  local_.assign(tree_.nodes.size(), {});
  parallel_for(pool_, tree_.leaves.size(), 64, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t node = tree_.leaf_nodes[i];
      const Placed& mesh = meshes_[tree_.nodes[node].mesh];
      Box& box = local_[node];
      for (std::uint32_t c = tree_.leaves[i].first_corner; c < tree_.leaves[i].end_corner; ++c)
        for (int k = 0; k < 3; ++k) {
          const double x =
              mesh.shape[3 * std::size_t{tree_.corners[c] - mesh.first_vertex} + static_cast<std::size_t>(k)];
          const auto at = static_cast<float>((x - mesh.center[k]) * mesh.scale);
          box.low[k] = std::min(box.low[k], at), box.high[k] = std::max(box.high[k], at);
        }
    }
  });
  for (std::size_t i = tree_.nodes.size(); i-- > 0;) {
    const Node& node = tree_.nodes[i];
    if (!node.children || node.mesh == mixed_meshes) continue;
    local_[i] = local_[node.children];
    local_[i].include(local_[node.children + 1]);
  }
}

bool PlacedMeshes::place(std::span<const rigid::Pose> poses) {
  const bool known = std::exchange(placed_, false);
  std::vector<char> moved(meshes_.size(), false);
  std::vector<Extent> extents;
  double most = 0;
  for (std::size_t m = 0; m < meshes_.size(); ++m) {
    Placed& mesh = meshes_[m];
    moved[m] = !known || !same(mesh.pose, poses[m]);
    if (moved[m]) mesh.pose = poses[m], mesh.placing = rigid::Placing(poses[m]);
    extents.push_back(extent_of(mesh));
    most = std::max({most, mesh.largest, max_norm(mesh.pose.shift)});
  }
  if (!(most <= 1e-3 * largest_coordinate)) return false;  // far from where sums could exceed it
  const CoordinateMap old_map = snapshot_.map;
  snapshot_.begin_placed(std::move(extents));
  if (finest_ * snapshot_.map.scale < 4 * least_spread) return false;
  if (!built_) build_tree();
  const bool new_map = !known || snapshot_.map != old_map;
  if (last_state_ > std::numeric_limits<std::uint32_t>::max() - 2 * meshes_.size() - 2) {
    std::ranges::fill(vertex_state_, 0u), std::ranges::fill(leaf_state_, 0u);
    last_state_ = 0, std::ranges::fill(moved, true);
  }
  for (std::size_t m = 0; m < meshes_.size(); ++m) {
    if (!moved[m] && !new_map) continue;
    meshes_[m].fitted = last_state_ += 2;
    map_boxes(meshes_[m]);
  }
  for (std::size_t i = mixed_.size(); i-- > 0;) {
    Node& node = tree_.nodes[mixed_[i]];
    node.box = at_pose(tree_.nodes[node.children]).box;
    node.box.include(at_pose(tree_.nodes[node.children + 1]).box);
  }
  return placed_ = true;
}

// Contains the mesh in the scene.
Extent PlacedMeshes::extent_of(const Placed& mesh) const {
  Extent e;
  if (!(mesh.local.low[0] <= mesh.local.high[0])) return e;
  const double shift[3] = {mesh.pose.shift.x, mesh.pose.shift.y, mesh.pose.shift.z};
  if (!turns(mesh.pose)) {
    for (int k = 0; k < 3; ++k) e.low[k] = mesh.local.low[k] + shift[k], e.high[k] = mesh.local.high[k] + shift[k];
    return e;
  }
  double r[3][3];
  matrix_of(mesh.pose, r);
  // Rounding errors here, and of positions (Placing): less than 1e-15 of each term.
  const double margin = 1e-14 * (mesh.largest + max_norm(mesh.pose.shift));
  for (int i = 0; i < 3; ++i) {
    double at = shift[i], half = margin;
    for (int j = 0; j < 3; ++j)
      at += r[i][j] * mesh.center[j], half += std::fabs(r[i][j]) * (0.5 * mesh.local.high[j] - 0.5 * mesh.local.low[j]);
    e.low[i] = at - half, e.high[i] = at + half;
  }
  return e;
}

void PlacedMeshes::map_boxes(Placed& mesh) {
  const CoordinateMap& map = snapshot_.map;
  double r[3][3], shift[4] = {};
  matrix_of(mesh.pose, r);
  const double from[3] = {mesh.pose.shift.x, mesh.pose.shift.y, mesh.pose.shift.z};
  for (int i = 0; i < 3; ++i) {
    shift[i] = from[i] - map.center[i];
    for (int j = 0; j < 3; ++j) shift[i] += r[i][j] * mesh.center[j];
    shift[i] *= map.scale;
  }
  const double ratio = map.scale / mesh.scale;
  const auto row = [](double x, double y, double z) {
    return Floats4{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z), 0};
  };
  for (int j = 0; j < 3; ++j) {
    const double x = ratio * r[0][j], y = ratio * r[1][j], z = ratio * r[2][j];
    mesh.axes[j] = row(x, y, z), mesh.extents[j] = row(std::fabs(x), std::fabs(y), std::fabs(z));
    mesh.slanted_axes[j] = row(x + y, y + z, z + x);
    mesh.slanted_extents[j] = row(std::fabs(x + y), std::fabs(y + z), std::fabs(z + x));
  }
  mesh.shift = row(shift[0], shift[1], shift[2]);
  mesh.slanted_shift = row(shift[0] + shift[1], shift[1] + shift[2], shift[2] + shift[0]);
  // Of sums in double precision, far from the origin: as in extent_of.
  const double largest = mesh.largest + max_norm(mesh.pose.shift) +
                         std::max({std::fabs(map.center[0]), std::fabs(map.center[1]), std::fabs(map.center[2])});
  const auto rounding = static_cast<float>(1e-14 * largest * map.scale);
  mesh.margin = all(axis_margin + rounding), mesh.slanted_margin = all(slanted_margin + 2 * rounding);
}

Node PlacedMeshes::at_pose(const Node& node) const {
  Node at;
  at.children = node.children, at.leaf = node.leaf, at.mesh = node.mesh;
  at.primitives = node.primitives, at.only_points = node.only_points;
  if (node.mesh == mixed_meshes) {
    at.box = node.box;
    return at;
  }
  const Placed& mesh = meshes_[node.mesh];
  const Box& box = local_[static_cast<std::size_t>(&node - tree_.nodes.data())];
  Floats4 center = mesh.shift, half = mesh.margin, slanted_center = mesh.slanted_shift,
          slanted_half = mesh.slanted_margin;
  for (int j = 0; j < 3; ++j) {
    const Floats4 c = all(0.5f * (box.low[j] + box.high[j])), h = all(0.5f * (box.high[j] - box.low[j]));
    center += mesh.axes[j] * c, half += mesh.extents[j] * h;
    slanted_center += mesh.slanted_axes[j] * c, slanted_half += mesh.slanted_extents[j] * h;
  }
  const auto store = [](float (&to)[3], Floats4 x) { memcpy(to, &x, sizeof to); };
  store(at.box.t0.low, center - half), store(at.box.t0.high, center + half);
  store(at.box.t1.low, slanted_center - slanted_half), store(at.box.t1.high, slanted_center + slanted_half);
  return at;
}

void PlacedMeshes::fit_vertex(std::uint32_t vertex, std::uint32_t fitted) {
  once(vertex_state_[vertex], fitted, [&] {
    const Vec3<double> x = position(vertex);
    VertexMotion& v = snapshot_.vertices[vertex];
    v.t0[0] = v.t1[0] = x.x, v.t0[1] = v.t1[1] = x.y, v.t0[2] = v.t1[2] = x.z;
  });
}

void PlacedMeshes::fit_vertices(std::span<const std::uint32_t> vertices) {
  for (const std::uint32_t v : vertices) fit_vertex(v, meshes_[features_.mesh_of_vertex[v]].fitted);
}

void PlacedMeshes::fit(std::uint32_t number) {
  const std::uint32_t fitted = meshes_[tree_.node_of_leaf(number).mesh].fitted;
  once(leaf_state_[number], fitted, [&] {
    const LeafRange& leaf = tree_.leaves[number];
    MotionBox boxes[CornersOf::most_corners];
    for (std::uint32_t i = 0; i < leaf.n_corners(); ++i) {
      const std::uint32_t vertex = tree_.corners[leaf.first_corner + i];
      fit_vertex(vertex, fitted);
      const double* x = snapshot_.vertices[vertex].t0;
      const SlantedCoordinates slanted({x[0], x[1], x[2]}, snapshot_.map);
      for (int k = 0; k < 3; ++k) {
        boxes[i].t0.low[k] = boxes[i].t0.high[k] = snapshot_.map(x[k], k);
        boxes[i].t1.low[k] = boxes[i].t1.high[k] = slanted.along[k];
      }
    }
    fit_leaf(tree_, number, boxes);
  });
}

std::size_t PlacedMeshes::bytes() const {
  return meshes_.capacity() * sizeof(Placed) + tree_.bytes() + snapshot_.bytes() + local_.capacity() * sizeof(Box) +
         4 * (mixed_.capacity() + vertex_state_.capacity() + leaf_state_.capacity());
}

}  // namespace hpccd
