// SPDX-License-Identifier: Apache-2.0
#include "solid/points.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "base/coordinate_limits.h"
#include "bvh/bad_coordinate.h"
#include "elementary/exact/intersection.h"
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

// Every third bit of the result is one of the lowest ten of x.
std::uint32_t spread_bits(std::uint32_t x) {
  x = (x | x << 16) & 0x030000ff;
  x = (x | x << 8) & 0x0300f00f;
  x = (x | x << 4) & 0x030c30c3;
  return (x | x << 2) & 0x09249249;
}

// The points in Morton order within the box of the mesh, three times as large. Stable, so it depends on nothing else.
std::vector<std::size_t> curve_order(const MeshInTree& mesh, const std::vector<Vec3<double>>& points,
                                     ThreadPool& pool) {
  constexpr std::uint32_t cells = 1024;
  const Extent& extent = mesh.snapshot.extent_of_mesh(mesh.mesh);
  double size = 0, low[3];
  for (int k = 0; k < 3; ++k) size = std::max(size, extent.high[k] - extent.low[k]);
  for (int k = 0; k < 3; ++k) low[k] = extent.low[k] - size;
  double per_cell = cells / 3.0 / size;
  if (!(per_cell < std::numeric_limits<double>::infinity())) per_cell = 0;
  struct Key {
    std::uint32_t code;
    std::size_t point;
  };
  std::vector<Key> keys(points.size());
  parallel_for(pool, points.size(), 4096, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) {
      const double at[3] = {points[i].x, points[i].y, points[i].z};
      std::uint32_t code = 0;
      for (int k = 0; k < 3; ++k)
        code |= spread_bits(static_cast<std::uint32_t>(std::clamp((at[k] - low[k]) * per_cell, 0.0, cells - 1.0))) << k;
      keys[i] = {code, i};
    }
  });
  std::vector<Key> sorted(points.size());
  constexpr int digit = 10;
  for (int shift = 0; shift < 30; shift += digit) {
    pool.cancellation().heed();
    std::vector<std::size_t> begin(std::size_t{1} << digit, 0);
    for (const Key& k : keys) ++begin[k.code >> shift & (cells - 1)];
    std::size_t sum = 0;
    for (std::size_t& b : begin) sum += std::exchange(b, sum);
    for (const Key& k : keys) sorted[begin[k.code >> shift & (cells - 1)]++] = k;
    keys.swap(sorted);
  }
  std::vector<std::size_t> order(points.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = keys[i].point;
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

  void find(const std::vector<Vec3<double>>& points, std::span<const std::size_t> which, SignedDistances& result) {
    starts_.clear(), start_of_.clear(), nearest_.clear();
    FreeBall last{};
    for (const std::size_t i : which) {
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
      const std::size_t i = which[j];
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
  const std::vector<std::size_t> order = curve_order(mesh, points, pool);
  WindingNumbers found;
  resize(found.numbers, points.size(), pool.cancellation());
  resize(found.on_surface, points.size(), pool.cancellation());
  parallel_for(pool, points.size(), points_per_piece, [&](std::size_t begin, std::size_t end, int) {
    Vec3<double> near[points_per_piece];
    Winding windings[points_per_piece];
    const std::span which = std::span(order).subspan(begin, end - begin);
    for (std::size_t j = 0; j < which.size(); ++j) near[j] = points[which[j]];
    find_windings(mesh, std::span(near).first(which.size()), windings);
    for (std::size_t j = 0; j < which.size(); ++j)
      found.numbers[which[j]] = windings[j].number, found.on_surface[which[j]] = windings[j].on_surface;
  });
  return found;
}

SignedDistances signed_distances(const MeshInTree& mesh, Positions given, ThreadPool& pool) {
  const std::vector<Vec3<double>> points = checked_points(given, pool);
  const std::vector<std::size_t> order = curve_order(mesh, points, pool);
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
