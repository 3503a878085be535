// SPDX-License-Identifier: Apache-2.0
#include "bvh/motion_bounds.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace hpccd {
namespace {

// Of ten pieces of 1024 vertices one of four threads gets three, a fifth more than its share.
constexpr std::size_t grain = 256;

// NaN fails the comparison as well.
bool acceptable(double x, double largest) { return std::fabs(x) <= largest; }

template <class Real>
Extent extent_of(const Real* x, std::size_t begin, std::size_t end, double largest) {
  Extent e;
  for (std::size_t i = begin; i < end; ++i)
    for (int k = 0; k < 3; ++k) {
      const double value = x[3 * i + k];
      e.good = e.good && acceptable(value, largest);
      e.low[k] = std::min(e.low[k], value);
      e.high[k] = std::max(e.high[k], value);
    }
  return e;
}

// As many digits as tell it apart: 1e+200, not two hundred zeros.
std::string shortest(double x) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, x).ptr};
}

template <class Real>
[[noreturn]] void report_bad(const char* name, const Real* x, std::size_t n, double largest) {
  for (std::size_t i = 0; i < n; ++i)
    for (int k = 0; k < 3; ++k) {
      const double value = x[3 * i + k];
      if (acceptable(value, largest)) continue;
      const std::string where = std::string(name) + "[" + std::to_string(i) + ", " + std::to_string(k) + "] is ";
      if (!std::isfinite(value))
        throw InvalidArgument(where + (std::isnan(value) ? "NaN" : "infinite") + "; all coordinates must be finite");
      throw InvalidArgument(where + shortest(value) + ", beyond " + shortest(largest) +
                            ": intermediate results could overflow; scale the scene down");
    }
  throw InvalidArgument(std::string(name) + " changed while it was being read");
}

template <bool grown, class Real>
void copy_motion(const Real* t0, const Real* t1, const CoordinateMap& map, double margin, std::size_t begin,
                 std::size_t end, VertexMotion* vertices, RoundedMotion* rounded, MotionBox* boxes, VertexKdop* kdops) {
  for (std::size_t i = begin; i < end; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double a = t0[3 * i + k], b = t1[3 * i + k];
      const float at_t0 = map(a, k), at_t1 = map(b, k);
      vertices[i].t0[k] = a;
      vertices[i].t1[k] = b;
      rounded[i].t0[k] = at_t0;
      rounded[i].t1[k] = at_t1;
      boxes[i].t0.low[k] = grown ? map(a - margin, k) : at_t0;
      boxes[i].t0.high[k] = grown ? map(a + margin, k) : at_t0;
      boxes[i].t1.low[k] = grown ? map(b - margin, k) : at_t1;
      boxes[i].t1.high[k] = grown ? map(b + margin, k) : at_t1;
    }
    kdops[i] = vertex_kdop({vertices[i].t0[0], vertices[i].t0[1], vertices[i].t0[2]},
                           {vertices[i].t1[0], vertices[i].t1[1], vertices[i].t1[2]}, map);
  }
}

// Of one snapshot. In place of a second end, bounds along three directions more: slanted features leave far less room.
template <class Real>
void copy_snapshot(const Real* x, const CoordinateMap& map, std::size_t begin, std::size_t end, VertexMotion* vertices,
                   MotionBox* boxes) {
  for (std::size_t i = begin; i < end; ++i) {
    const Vec3<double> v{x[3 * i], x[3 * i + 1], x[3 * i + 2]};
    const double at[3] = {v.x, v.y, v.z};
    const SlantedCoordinates slanted(v, map);
    for (int k = 0; k < 3; ++k) {
      vertices[i].t0[k] = vertices[i].t1[k] = at[k];
      boxes[i].t0.low[k] = boxes[i].t0.high[k] = map(at[k], k);
      boxes[i].t1.low[k] = boxes[i].t1.high[k] = slanted.along[k];
    }
  }
}

// By how much the boxes of a mesh grow: half the separation, of which halving a denormal number may lose one half of
// the least, and what rounding x - margin and x + margin can lose. More than the scene is large would not bring more
// pairs, but boxes without an area.
double margin_for(double separation, const Extent& scene) {
  if (!(separation > 0)) return 0;
  double most = 0, size = 0;
  for (int k = 0; k < 3; ++k) {
    most = std::max({most, std::fabs(scene.low[k]), std::fabs(scene.high[k])});
    size = std::max(size, scene.high[k] - scene.low[k]);
  }
  const double reach = std::min(0.5 * separation + std::numeric_limits<double>::denorm_min(), size);
  return reach + 4.5e-16 * (most + reach);
}

// Pieces of the wanted parts, each with the number of its part.
struct Piece {
  std::size_t begin, end, part;
};

template <class Wanted>
std::vector<Piece> pieces_of(const std::vector<VertexRange>& parts, Wanted&& wanted) {
  std::vector<Piece> pieces;
  for (std::size_t p = 0; p < parts.size(); ++p)
    if (wanted(p))
      for (std::size_t i = parts[p].begin; i < parts[p].end; i += grain)
        pieces.push_back({i, std::min(i + grain, parts[p].end), p});
  return pieces;
}

}  // namespace

void Extent::include(const Extent& e) {
  good = good && e.good;
  for (int k = 0; k < 3; ++k) {
    low[k] = std::min(low[k], e.low[k]);
    high[k] = std::max(high[k], e.high[k]);
  }
}

template <class Real>
void MotionBounds::update(const Real* t0, const Real* t1, std::size_t n, std::span<const double> separations,
                          ThreadPool& pool) {
  if (snapshot_ != was_snapshot_) resting.clear();  // what one takes may be too large for the other
  const auto moves = [&](std::size_t part) { return resting.empty() || !resting[part]; };
  std::vector<Piece> pieces = pieces_of(parts_, moves);
  std::vector<Extent> extents(pieces.size());
  parallel_for(pool, pieces.size(), 1, [&](std::size_t from, std::size_t to, int) {
    for (std::size_t i = from; i < to; ++i) {
      extents[i] = extent_of(t0, pieces[i].begin, pieces[i].end, largest_);
      if (!snapshot_) extents[i].include(extent_of(t1, pieces[i].begin, pieces[i].end, largest_));
    }
  });
  extents_.resize(parts_.size());
  for (std::size_t p = 0; p < parts_.size(); ++p)
    if (moves(p)) extents_[p] = {};
  for (std::size_t i = 0; i < pieces.size(); ++i) extents_[pieces[i].part].include(extents[i]);
  Extent whole;
  for (const Extent& e : extents_) whole.include(e);
  if (!whole.good) {
    if (!extent_of(t0, 0, n, largest_).good) report_bad(snapshot_ ? "vertices" : "vertices_t0", t0, n, largest_);
    report_bad("vertices_t1", t1, n, largest_);
  }

  const CoordinateMap old_map = map;
  if (n > 0) map = CoordinateMap::around(whole.low, whole.high);
  double most = 0;
  for (int k = 0; n > 0 && k < 3; ++k) most = std::max({most, std::fabs(whole.low[k]), std::fabs(whole.high[k])});
  rounding = 1e-15 * most;
  std::vector<double> margins(parts_.size(), 0);
  if (!separations.empty() && n > 0)
    for (std::size_t p = 0; p < parts_.size(); ++p) margins[p] = margin_for(separations[p], whole);
  if (!resting.empty() && (!(map == old_map) || margins != margins_)) {
    resting.clear();
    pieces = pieces_of(parts_, moves);
  }
  margins_ = std::move(margins);
  grown = std::ranges::any_of(margins_, [](double margin) { return margin > 0; });
  was_snapshot_ = snapshot_;
  resize(vertices, n, pool.cancellation());
  resize(boxes, n, pool.cancellation());
  resize(kdops, n, pool.cancellation());
  if (!snapshot_) resize(rounded, n, pool.cancellation());
  parallel_for(pool, pieces.size(), 1, [&](std::size_t from, std::size_t to, int) {
    for (std::size_t i = from; i < to; ++i) {
      const auto [begin, end, part] = pieces[i];
      const auto copy = [&](auto&& copied) {
        copied(t0, t1, map, margins_[part], begin, end, vertices.data(), rounded.data(), boxes.data(), kdops.data());
      };
      if (snapshot_)
        copy_snapshot(t0, map, begin, end, vertices.data(), boxes.data());
      else if (margins_[part] > 0)
        copy(copy_motion<true, Real>);
      else
        copy(copy_motion<false, Real>);
    }
  });
}

void MotionBounds::update_all(Positions t0, Positions t1, std::span<const double> separations, ThreadPool& pool) {
  if (!std::exchange(complete_, false)) resting.clear();
  if (t0.is_double)
    update(static_cast<const double*>(t0.data), static_cast<const double*>(t1.data), t0.n, separations, pool);
  else
    update(static_cast<const float*>(t0.data), static_cast<const float*>(t1.data), t0.n, separations, pool);
  complete_ = true;
}

// Each mesh is a part.
void MotionBounds::divide(const Scene& scene) {
  parts_.clear();
  for (const Scene::Mesh& m : scene.meshes())
    parts_.push_back({m.first_vertex, std::size_t{m.first_vertex} + m.n_vertices});
}

void MotionBounds::update(const Scene& scene, Positions t0, Positions t1, std::span<const double> separations,
                          ThreadPool& pool) {
  divide(scene);
  resting = statics_.unchanged(scene, t0, t1, pool);
  largest_ = largest_coordinate, snapshot_ = false;
  update_all(t0, t1, separations, pool);
}

void MotionBounds::update(const Scene& scene, Positions vertices, ThreadPool& pool) {
  divide(scene);
  resting = statics_.unchanged(scene, vertices, vertices, pool);
  largest_ = largest_in_snapshot, snapshot_ = true;
  update_all(vertices, vertices, {}, pool);
}

void MotionBounds::update(Positions t0, Positions t1, ThreadPool& pool) {
  largest_ = largest_coordinate, snapshot_ = false;
  parts_ = {{0, t0.n}};
  resting.clear();
  update_all(t0, t1, {}, pool);
}

void MotionBounds::sweep(ThreadPool& pool) {
  resize(swept, boxes.size(), pool.cancellation());
  parallel_for(pool, boxes.size(), grain, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) swept[i] = boxes[i].swept();
  });
}

std::size_t MotionBounds::bytes() const {
  return vertices.capacity() * sizeof(VertexMotion) + boxes.capacity() * sizeof(MotionBox) +
         swept.capacity() * sizeof(Box) + kdops.capacity() * sizeof(VertexKdop) +
         rounded.capacity() * sizeof(RoundedMotion) + statics_.bytes();
}

}  // namespace hpccd
