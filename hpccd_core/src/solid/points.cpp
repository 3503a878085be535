// SPDX-License-Identifier: Apache-2.0
#include "solid/points.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <span>
#include <vector>

#include "base/coordinate_limits.h"
#include "bvh/bad_coordinate.h"
#include "elementary/exact/intersection.h"
#include "solid/curve_order.h"
#include "solid/nearest_face.h"
#include "solid/winding.h"

namespace hpccd {
namespace {

// Points of one piece of work: many enough that the first, which knows nothing of others, does not matter.
constexpr std::size_t points_per_piece = 256;

template <class Real>
void read(const Real* x, std::size_t n, ThreadPool& pool, std::vector<Vec3<double>>& points) {
  std::atomic<bool> good{true};
  parallel_for(pool, n, 4096, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) {
      points[i] = {x[3 * i], x[3 * i + 1], x[3 * i + 2]};
      if (!acceptable(max_norm(points[i]), largest_in_snapshot) || !(points[i].x == points[i].x) ||
          !(points[i].y == points[i].y) || !(points[i].z == points[i].z))
        good.store(false, std::memory_order_relaxed);
    }
  });
  if (!good) report_bad("points", x, n, largest_in_snapshot);
}

// Within the box of the mesh, three times as large.
std::vector<OnCurve> order_near(const MeshInTree& mesh, const std::vector<Vec3<double>>& points, ThreadPool& pool) {
  const Extent& extent = mesh.snapshot.extent_of_mesh(mesh.mesh);
  double size = 0;
  for (int k = 0; k < 3; ++k) size = std::max(size, extent.high[k] - extent.low[k]);
  const Curve curve({extent.low[0] - size, extent.low[1] - size, extent.low[2] - size}, 3 * size);
  std::vector<OnCurve> order(points.size());
  parallel_for(pool, points.size(), 4096, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) order[i] = {curve.code(points[i]), i};
  });
  sort_by_code(order, pool.cancellation());
  return order;
}

// Of points in an order in which neighbours are near each other.
void find_windings(const MeshInTree& m, std::span<const Vec3<double>> points, std::span<Winding> found) {
  for (std::size_t i = 0; i < points.size(); i += points_at_once) {
    const std::size_t n = std::min(points_at_once, points.size() - i);
    winding_numbers(m.tree, m.snapshot, m.features, m.mesh, points.subspan(i, n), found.subspan(i, n));
  }
}

// The lowest face that contains a point.
std::uint32_t face_at(const MeshInTree& m, const Vec3<double>& point) {
  const std::array<float, 3> at = m.mapped(point);
  std::uint32_t lowest = Tree::none;
  std::vector<std::uint32_t> stack{0};
  while (!stack.empty()) {
    const Node& node = m.tree.nodes[stack.back()];
    stack.pop_back();
    const Box& box = node.box.t0;
    bool outside = !m.may_be_below(node);
    for (std::size_t k = 0; k < 3; ++k) outside = outside || at[k] < box.low[k] || at[k] > box.high[k];
    if (outside) continue;
    if (node.children) {
      stack.push_back(node.children + 1), stack.push_back(node.children);
      continue;
    }
    const LeafRange& leaf = m.tree.leaves[node.leaf];
    for (std::uint32_t slot = leaf.first_face; slot < leaf.end_face; ++slot) {
      const std::uint32_t face = m.tree.face_of_slot[slot];
      const auto& f = m.features.faces[face];
      const Vec3<double> pair[5] = {point, point, m.position(f[0]), m.position(f[1]), m.position(f[2])};
      if (face < lowest && exact::intersect(pair)) lowest = face;
    }
  }
  return lowest;
}

// A ball in which no point is on the surface: the winding number is the same everywhere in it.
struct FreeBall {
  Vec3<double> center;
  double radius;

  // Four rounding errors; if the squares underflow, the points are less than 1e-150 apart.
  bool contains(const Vec3<double>& point) const {
    const Vec3<double> d = point - center;
    return std::sqrt(dot(d, d)) * (1 + 1e-15) + 1e-150 < radius;
  }
};

// Signed distances of the points of one piece.
class Piece {
 public:
  Piece(const MeshInTree& mesh, NearestFaceSearch& search) : mesh_(mesh), search_(search) {}

  void find(const std::vector<Vec3<double>>& points, std::span<const OnCurve> which, SignedDistances& result) {
    starts_.clear(), start_of_.clear(), nearest_.clear();
    FreeBall last{};
    for (const auto& [code, i] : which) {
      nearest_.push_back(search_.find(points[i], nearest_.empty() ? Tree::none : nearest_.back().face));
      const NearestFace& found = nearest_.back();
      const FreeBall here{points[i], found.distance * (1 - 1e-15) - found.error};
      // Otherwise the winding number is that of the point before.
      if (starts_.empty() || !(last.contains(here.center) || here.contains(last.center))) starts_.push_back(points[i]);
      start_of_.push_back(starts_.size() - 1);
      last = here;
    }
    windings_.resize(starts_.size());
    find_windings(mesh_, starts_, windings_);
    for (std::size_t j = 0; j < which.size(); ++j) {
      const std::size_t i = which[j].point;
      const Winding& winding = windings_[start_of_[j]];
      NearestFace& found = nearest_[j];
      if (winding.on_surface) found = {0, face_at(mesh_, points[i]), points[i]};
      result.distance[i] = winding.number != 0 ? -found.distance : found.distance;
      result.faces[i] = found.face;
      result.closest[i] = {found.point.x, found.point.y, found.point.z};
    }
  }

 private:
  const MeshInTree& mesh_;
  NearestFaceSearch& search_;
  std::vector<Vec3<double>> starts_;   // points whose winding numbers must be found
  std::vector<std::size_t> start_of_;  // by point
  std::vector<NearestFace> nearest_;
  std::vector<Winding> windings_;
};

}  // namespace

std::vector<Vec3<double>> checked_points(Positions points, ThreadPool& pool) {
  std::vector<Vec3<double>> all;
  resize(all, points.n, pool.cancellation());
  if (points.is_double)
    read(static_cast<const double*>(points.data), points.n, pool, all);
  else
    read(static_cast<const float*>(points.data), points.n, pool, all);
  return all;
}

WindingNumbers winding_numbers(const MeshInTree& mesh, Positions given, ThreadPool& pool) {
  const std::vector<Vec3<double>> points = checked_points(given, pool);
  // Beyond the box of the mesh they are 0.
  const Extent& extent = mesh.snapshot.extent_of_mesh(mesh.mesh);
  std::vector<Vec3<double>> in_box;
  std::vector<std::size_t> number;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3<double>& p = points[i];
    if (p.x < extent.low[0] || p.x > extent.high[0] || p.y < extent.low[1] || p.y > extent.high[1] ||
        p.z < extent.low[2] || p.z > extent.high[2])
      continue;
    in_box.push_back(p), number.push_back(i);
  }
  const std::vector<OnCurve> order = order_near(mesh, in_box, pool);
  WindingNumbers found;
  resize(found.numbers, points.size(), pool.cancellation());
  resize(found.on_surface, points.size(), pool.cancellation());
  parallel_for(pool, order.size(), points_per_piece, [&](std::size_t begin, std::size_t end, int) {
    Vec3<double> near[points_per_piece];
    Winding windings[points_per_piece];
    const std::span which = std::span(order).subspan(begin, end - begin);
    for (std::size_t j = 0; j < which.size(); ++j) near[j] = in_box[which[j].point];
    find_windings(mesh, std::span(near).first(which.size()), windings);
    for (std::size_t j = 0; j < which.size(); ++j) {
      const std::size_t i = number[which[j].point];
      found.numbers[i] = windings[j].number, found.on_surface[i] = windings[j].on_surface;
    }
  });
  return found;
}

SignedDistances signed_distances(const MeshInTree& mesh, Positions given, ThreadPool& pool) {
  const std::vector<Vec3<double>> points = checked_points(given, pool);
  const std::vector<OnCurve> order = order_near(mesh, points, pool);
  SignedDistances result;
  resize(result.distance, points.size(), pool.cancellation());
  resize(result.faces, points.size(), pool.cancellation());
  resize(result.closest, points.size(), pool.cancellation());
  std::vector<NearestFaceSearch> searches(static_cast<std::size_t>(pool.size()), NearestFaceSearch(mesh));
  parallel_for(pool, points.size(), points_per_piece, [&](std::size_t begin, std::size_t end, int thread) {
    Piece(mesh, searches[static_cast<std::size_t>(thread)])
        .find(points, std::span(order).subspan(begin, end - begin), result);
  });
  return result;
}

}  // namespace hpccd
