// SPDX-License-Identifier: Apache-2.0
#include "bvh/motion_bounds.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "bvh/bad_coordinate.h"
#include "scene/edge_sample.h"

namespace hpccd {
namespace {

// With ten pieces of 1024 vertices, one of four threads would get three, a fifth more than its share.
constexpr std::size_t grain = 256;

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

// box_map(x, k): coordinate k of a box. margin_of(i), of_any_part (see MotionBounds): for grown boxes.
template <bool grown, class Real, class BoxMap, class Margin>
void copy_motion(const Real* t0, const Real* t1, const CoordinateMap& map, const BoxMap& box_map, Margin&& margin_of,
                 bool of_any_part, std::size_t begin, std::size_t end, VertexMotion* vertices, RoundedMotion* rounded,
                 MotionBox* boxes, VertexKdop* kdops) {
  for (std::size_t i = begin; i < end; ++i) {
    [[maybe_unused]] const double margin = margin_of(i);
    for (int k = 0; k < 3; ++k) {
      const double a = t0[3 * i + k], b = t1[3 * i + k];
      const float at_t0 = map(a, k), at_t1 = map(b, k);
      vertices[i].t0[k] = a;
      vertices[i].t1[k] = b;
      rounded[i].t0[k] = at_t0;
      rounded[i].t1[k] = at_t1;
      if constexpr (grown) {
        boxes[i].t0.low[k] = box_map(a - margin, k);
        boxes[i].t0.high[k] = box_map(a + margin, k);
        boxes[i].t1.low[k] = box_map((of_any_part && a < b ? a : b) - margin, k);
        boxes[i].t1.high[k] = box_map((of_any_part && a > b ? a : b) + margin, k);
      } else {
        constexpr bool common = std::is_same_v<BoxMap, CoordinateMap>;
        boxes[i].t0.low[k] = boxes[i].t0.high[k] = common ? at_t0 : box_map(a, k);
        boxes[i].t1.low[k] = boxes[i].t1.high[k] = common ? at_t1 : box_map(b, k);
      }
    }
    kdops[i] = vertex_kdop({vertices[i].t0[0], vertices[i].t0[1], vertices[i].t0[2]},
                           {vertices[i].t1[0], vertices[i].t1[1], vertices[i].t1[2]}, map);
  }
}

// For one snapshot: bounds along three more directions take the place of the second end. They leave far fewer pairs of
// slanted features. slanted(x): the coordinates along these directions.
template <class Real, class BoxMap, class Slanted>
void copy_snapshot(const Real* x, const BoxMap& map, const Slanted& slanted, std::size_t begin, std::size_t end,
                   VertexMotion* vertices, MotionBox* boxes) {
  for (std::size_t i = begin; i < end; ++i) {
    const Vec3<double> v{x[3 * i], x[3 * i + 1], x[3 * i + 2]};
    const double at[3] = {v.x, v.y, v.z};
    const auto slanted_at = slanted(v);
    for (int k = 0; k < 3; ++k) {
      vertices[i].t0[k] = vertices[i].t1[k] = at[k];
      boxes[i].t0.low[k] = boxes[i].t0.high[k] = map(at[k], k);
      boxes[i].t1.low[k] = boxes[i].t1.high[k] = slanted_at.along[k];
    }
  }
}

// For each plane of two axes, the direction along which edges extend least, so that slanted bars are separated as well
// as upright ones. `extents`: by plane and direction. The default directions are kept unless another one is far better:
// for sheets that are cut into triangles along one diagonal, another one would gain nothing.
std::array<SlantedDirection, 3> best_directions(const double (&extents)[3][std::size(slanted_directions)]) {
  std::array<SlantedDirection, 3> best;
  for (std::size_t k = 0; k < 3; ++k) {
    double least = 0.4 * extents[k][0];
    for (std::size_t i = 1; i < std::size(slanted_directions); ++i)
      if (extents[k][i] < least) least = extents[k][i], best[k] = slanted_directions[i];
  }
  return best;
}

// The amount by which the boxes of a mesh grow: half the separation (halving a denormal number may lose half of the
// smallest one) and the rounding errors of x - margin and x + margin. A margin beyond the size of the scene would not
// add pairs, only boxes without an area.
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
void MotionBounds::update(const Real* t0, const Real* t1, std::size_t n, const Growth& growth, ThreadPool& pool) {
  if (snapshot_ != was_snapshot_) resting.clear();  // a value allowed for one may be too large for the other
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
  const std::array<SlantedDirection, 3> old_slanted = slanted_;
  if (n > 0) map = CoordinateMap::around(whole.low, whole.high);
  double most = 0;
  for (int k = 0; n > 0 && k < 3; ++k) most = std::max({most, std::fabs(whole.low[k]), std::fabs(whole.high[k])});
  rounding = 1e-15 * most;
  measure_edges(t0, t1);
  std::vector<double> margins(parts_.size(), 0);
  if (!growth.separations.empty() && n > 0)
    for (std::size_t p = 0; p < parts_.size(); ++p) margins[p] = margin_for(growth.separations[p], whole);
  bool same_margins = margins == margins_;
  margins_ = std::move(margins);
  largest_here_ = most, scene_size_ = 0, thicker_than_scene_ = false;
  for (int k = 0; n > 0 && k < 3; ++k) scene_size_ = std::max(scene_size_, whole.high[k] - whole.low[k]);
  thickness_ = growth.thickness;
  std::vector<double> thickest;
  for (const double t : growth.thickest) {
    thickest.push_back(thickness_in_box(t));
    thicker_than_scene_ = thicker_than_scene_ || t > scene_size_;
  }
  same_margins = same_margins && thickest == thickest_ && version_of_thickness_ == growth.version_of_thickness;
  thickest_ = std::move(thickest), version_of_thickness_ = growth.version_of_thickness;
  const std::vector<SqueezedAxis> old_squeezed = std::move(squeezed);
  squeezed.clear();
  box_scale = map.scale, box_rounding = rounding;
  const double fine = finest();
  spread = fine > 0 && fine * map.scale < least_spread;
  if (spread) squeeze(t0, t1, n, fine, whole, pool);
  if (!resting.empty() && (!(map == old_map && slanted_ == old_slanted) || !same_margins || squeezed != old_squeezed)) {
    resting.clear();
    pieces = pieces_of(parts_, moves);
  }
  grown = of_any_part || thickness_ || std::ranges::any_of(margins_, [](double margin) { return margin > 0; });
  was_snapshot_ = snapshot_;
  resize(vertices, n, pool.cancellation());
  resize(boxes, n, pool.cancellation());
  resize(kdops, n, pool.cancellation());
  if (!snapshot_) resize(rounded, n, pool.cancellation());
  const auto squeezed_map = this->squeezed_map();
  struct Along {
    float along[3];
  };
  const auto common_slanted = [this](const Vec3<double>& x) { return SlantedCoordinates(x, map); };
  const auto chosen_slanted = [this](const Vec3<double>& v) {
    const auto x = [&](int k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; };
    const auto center = [&](int k) { return map.center[k]; };
    Along at;
    for (int k = 0; k < 3; ++k) {
      const SlantedDirection& d = slanted_[static_cast<std::size_t>(k)];
      at.along[k] = squeezed.empty() ? static_cast<float>((d.along(k, x) - d.along(k, center)) * (map.scale * d.factor))
                                     : squeezed[static_cast<std::size_t>(3 + k)](d.along(k, x));
    }
    return at;
  };
  const bool common = slanted_ == std::array<SlantedDirection, 3>();
  parallel_for(pool, pieces.size(), 1, [&](std::size_t from, std::size_t to, int) {
    for (std::size_t i = from; i < to; ++i) {
      const auto [begin, end, part] = pieces[i];
      if (!snapshot_)
        copy(t0, t1, begin, end, part);
      else if (!squeezed.empty())
        copy_snapshot(t0, squeezed_map, chosen_slanted, begin, end, vertices.data(), boxes.data());
      else if (!common)
        copy_snapshot(t0, map, chosen_slanted, begin, end, vertices.data(), boxes.data());
      else
        copy_snapshot(t0, map, common_slanted, begin, end, vertices.data(), boxes.data());
    }
  });
}

template <class Real>
void MotionBounds::copy(const Real* t0, const Real* t1, std::size_t begin, std::size_t end, std::size_t part) {
  const double margin = margins_[part];
  const auto copy = [&](const auto& box_map) {
    if (thickness_ && thickest_[part] > 0)
      copy_motion<true>(
          t0, t1, map, box_map, [&](std::size_t i) { return margin + thickness_in_box(thickness_[i]); }, of_any_part,
          begin, end, vertices.data(), rounded.data(), boxes.data(), kdops.data());
    else if (margin > 0 || of_any_part)
      copy_motion<true>(
          t0, t1, map, box_map, [&](std::size_t) { return margin; }, of_any_part, begin, end, vertices.data(),
          rounded.data(), boxes.data(), kdops.data());
    else
      copy_motion<false>(
          t0, t1, map, box_map, [](std::size_t) { return 0.0; }, false, begin, end, vertices.data(), rounded.data(),
          boxes.data(), kdops.data());
  };
  squeezed.empty() ? copy(map) : copy(squeezed_map());
}

// The part of a margin that is due to a thickness. The margin is at most twice the scene's extent for a separation,
// plus this: rounding errors of both sums, of the sum of separation and thicknesses, and of x - margin and x + margin.
double MotionBounds::thickness_in_box(double thickness) const {
  if (!(thickness > 0)) return 0;
  const double reach = std::min(thickness, scene_size_);
  return reach + 2e-15 * (largest_here_ + 2 * scene_size_);
}

void MotionBounds::shorten(Positions t0, Positions t1, std::span<const std::uint32_t> changed, ThreadPool& pool) {
  parallel_for(pool, changed.size(), grain, [&](std::size_t begin, std::size_t end, int) {
    for (const std::uint32_t i : changed.subspan(begin, end - begin)) {
      const std::size_t part = features->mesh_of_vertex[i];
      if (t0.is_double)
        copy(static_cast<const double*>(t0.data), static_cast<const double*>(t1.data), i, i + 1, part);
      else
        copy(static_cast<const float*>(t0.data), static_cast<const float*>(t1.data), i, i + 1, part);
    }
  });
}

// Measures the lengths of edges, and for a snapshot also their slant.
template <class Real>
void MotionBounds::measure_edges(const Real* t0, const Real* t1) {
  short_edge = 0;
  slanted_ = {};
  if (!features) return;
  const auto extent = [](const Real* a, const Real* b) {
    double most = 0;
    for (int k = 0; k < 3; ++k) most = std::max(most, std::fabs(double{a[k]} - double{b[k]}));
    return most;
  };
  double extents[3][std::size(slanted_directions)] = {};
  // Only motions have to decide whether floats suffice; otherwise a few edges are enough. In small scenes, measuring
  // edges would take longer than it could save.
  constexpr std::size_t edges_of_a_snapshot = 16, few_edges = 256;
  const std::size_t wanted = snapshot_ ? edges_of_a_snapshot : edges_of_a_step;
  if (snapshot_ && features->edges.size() < few_edges) return;
  short_edge = hpccd::short_edge(features->edges, wanted, [&](std::uint32_t from, std::uint32_t to) {
    const std::size_t a = 3 * std::size_t{from}, b = 3 * std::size_t{to};
    const double length = extent(t0 + a, t0 + b);
    if (!snapshot_) return std::min(length, extent(t1 + a, t1 + b));
    const auto x = [&](int k) { return double{t0[a + k]} - double{t0[b + k]}; };
    for (int k = 0; k < 3; ++k)
      for (std::size_t i = 0; i < std::size(slanted_directions); ++i) {
        const SlantedDirection& d = slanted_directions[i];
        extents[k][i] += std::fabs(d.along(k, x)) * (d.factor < 1 ? 0.8944 : 0.7071);
      }
    return length;
  });
  if (snapshot_) slanted_ = best_directions(extents);
}

// The length of the finest features of the scene: of its short edges, and of meshes that have more than 64 pairs of
// their vertices per vertex of the scene.
double MotionBounds::finest() const {
  double least = short_edge > 0 ? short_edge : std::numeric_limits<double>::infinity();
  for (std::size_t p = 0; features && p < parts_.size(); ++p) {
    const auto n = static_cast<double>(parts_[p].end - parts_[p].begin);
    if (n * n < 64.0 * features->n_vertices) continue;
    double size = 0;
    for (int k = 0; k < 3; ++k) size = std::max(size, extents_[p].high[k] - extents_[p].low[k]);
    if (size > 0) least = std::min(least, size / std::sqrt(n));
  }
  return std::isfinite(least) ? least : 0;
}

// Shortens gaps, but not beyond the point where the finest edges are a 4,096th of the scene. No gap becomes so short
// that features at its ends could count as near.
template <class Real>
void MotionBounds::squeeze(const Real* t0, const Real* t1, std::size_t n, double finest, const Extent& whole,
                           ThreadPool& pool) {
  const double wanted = 4096 * finest, least = std::max(8 * finest, 4 * distance_);
  const std::size_t n_axes = snapshot_ ? 6 : 3;
  std::vector<std::optional<SqueezedAxis>> axes(n_axes);
  parallel_for_each(pool, n_axes, [&](std::size_t axis) {
    const int k = static_cast<int>(axis % 3);
    std::vector<Stretch> stretches(n);
    for (std::size_t p = 0; p < parts_.size(); ++p)
      for (std::size_t i = parts_[p].begin; i < parts_[p].end; ++i) {
        if (axis >= 3) {
          const double x = slanted_[axis - 3].along(k, [&](int j) { return double{t0[3 * i + j]}; });
          stretches[i] = {x, x};
        } else {
          const double a = t0[3 * i + k], b = t1[3 * i + k];
          stretches[i] = {std::min(a, b) - growth_of_mesh(p), std::max(a, b) + growth_of_mesh(p)};
        }
      }
    axes[axis].emplace(stretches, wanted, least);
  });
  double length = 0, whole_length = 0;
  for (int k = 0; k < 3; ++k) {
    length = std::max(length, axes[k]->length());
    whole_length = std::max(whole_length, whole.high[k] - whole.low[k]);
  }
  if (!(length > 0 && length < whole_length / 4)) return;
  box_scale = std::ldexp(1.0, -std::clamp(std::ilogb(length / 2), -1000, 1000));
  // Sums of two coordinates far from zero may be too coarse, or have more gaps than the coordinates.
  const bool coarse = box_scale * rounding > 1e-7;
  for (std::size_t axis = 0; axis < n_axes; ++axis) {
    const double scale = axis < 3 ? box_scale : box_scale * slanted_[axis - 3].factor;
    const bool use = axis < 3 || (!coarse && axes[axis]->length() * scale <= 9);
    axes[axis]->set_scale(use ? scale : 0);
    squeezed.push_back(std::move(*axes[axis]));
  }
  if (coarse) box_rounding = 0;
}

void MotionBounds::update_all(Positions t0, Positions t1, const Growth& growth, ThreadPool& pool) {
  if (!std::exchange(complete_, false)) resting.clear();
  if (t0.is_double)
    update(static_cast<const double*>(t0.data), static_cast<const double*>(t1.data), t0.n, growth, pool);
  else
    update(static_cast<const float*>(t0.data), static_cast<const float*>(t1.data), t0.n, growth, pool);
  complete_ = true;
}

// Each mesh is a part.
void MotionBounds::divide(const Scene& scene) {
  parts_.clear();
  for (const Scene::Mesh& m : scene.meshes())
    parts_.push_back({m.first_vertex, std::size_t{m.first_vertex} + m.n_vertices});
}

void MotionBounds::update(const Scene& scene, Positions t0, Positions t1, const Growth& growth, ThreadPool& pool) {
  divide(scene);
  resting = statics_.unchanged(scene, t0, t1, pool);
  largest_ = largest_coordinate, snapshot_ = false, distance_ = 0;
  update_all(t0, t1, growth, pool);
}

void MotionBounds::update(const Scene& scene, Positions vertices, ThreadPool& pool, double distance) {
  divide(scene);
  resting = statics_.unchanged(scene, vertices, vertices, pool);
  largest_ = largest_in_snapshot, snapshot_ = true, distance_ = distance;
  update_all(vertices, vertices, {}, pool);
}

void MotionBounds::begin_placed(std::vector<Extent> of_meshes) {
  extents_ = std::move(of_meshes);
  Extent whole;
  for (const Extent& e : extents_) whole.include(e);
  double most = 0;
  for (int k = 0; k < 3; ++k) most = std::max({most, std::fabs(whole.low[k]), std::fabs(whole.high[k])});
  map = CoordinateMap::around(whole.low, whole.high);
  rounding = box_rounding = 1e-15 * most;
  box_scale = map.scale;
  slanted_ = {}, squeezed.clear();
  snapshot_ = true, spread = grown = false;
}

void MotionBounds::update(Positions t0, Positions t1, ThreadPool& pool) {
  largest_ = largest_coordinate, snapshot_ = false, distance_ = 0;
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
