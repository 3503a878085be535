// SPDX-License-Identifier: Apache-2.0
#include "solid/nearest_face.h"

#include <cmath>
#include <cstring>
#include <utility>

#include "base/simd/four.h"
#include "elementary/exact/distance.h"

namespace hpccd {
namespace {

constexpr double near_enough = 1e8;  // see far_away

template <class Real>
Real beyond(Real low, Real high, Real at) {
  return std::max(std::max(low - at, at - high), Real(0));
}

// Of the box of a node.
double square_of_gap(const Node& node, const double (&at)[3]) {
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const double gap = beyond<double>(node.box.t0.low[k], node.box.t0.high[k], at[k]);
    sum += gap * gap;
  }
  return sum;
}

// Loads four numbers where three are used, as Node::overlaps.
float square_of_gap(const Node& node, const float (&at)[3]) {
  const Floats4 x = {at[0], at[1], at[2], 0}, zero{};
  const Floats4 gap = max4(max4(load4(node.box.t0.low) - x, x - load4(node.box.t0.high)), zero), s = gap * gap;
  return s[0] + s[1] + s[2];
}

const float* row(const Block& block, Side side, std::uint32_t k) { return block.rows[bound_number(0, side, k)]; }

// Of the boxes of a block's leaves.
void squares_of_gaps(const Block& block, const double (&at)[3], double* gaps) {
  for (std::uint32_t i = 0; i < Block::width; ++i) {
    gaps[i] = 0;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const double gap = beyond<double>(row(block, Side::low, k)[i], row(block, Side::high, k)[i], at[k]);
      gaps[i] += gap * gap;
    }
  }
}

void squares_of_gaps(const Block& block, const float (&at)[3], float* gaps) {
  for (std::uint32_t i = 0; i < Block::width; i += 4) {
    Floats4 sum{};
    for (std::uint32_t k = 0; k < 3; ++k) {
      const Floats4 x = Floats4{} + at[k], zero{};
      const Floats4 gap =
          max4(max4(load4(row(block, Side::low, k) + i) - x, x - load4(row(block, Side::high, k) + i)), zero);
      sum += gap * gap;
    }
    std::memcpy(gaps + i, &sum, sizeof sum);
  }
}

// How far corners are from a point along u.
void distances_along(const CornerRow* rows, const double (&at)[3], const double (&u)[3], double* along) {
  for (std::uint32_t i = 0; i < CornerRow::width; ++i)
    along[i] = u[0] * (rows[0].lane[i] - at[0]) + u[1] * (rows[1].lane[i] - at[1]) + u[2] * (rows[2].lane[i] - at[2]);
}

void distances_along(const CornerRow* rows, const float (&at)[3], const float (&u)[3], float* along) {
  for (std::uint32_t i = 0; i < CornerRow::width; i += 4) {
    const Floats4 x = load4(rows[0].lane + i) - at[0], y = load4(rows[1].lane + i) - at[1],
                  z = load4(rows[2].lane + i) - at[2];
    const Floats4 sum = u[0] * x + u[1] * y + u[2] * z;
    std::memcpy(along + i, &sum, sizeof sum);
  }
}

}  // namespace

NearestFaceSearch::NearestFaceSearch(const MeshInTree& mesh) : mesh_(mesh) {
  if (mesh_.snapshot.spread) make_fine_boxes();
}

void NearestFaceSearch::make_fine_boxes() {
  const Tree& tree = mesh_.tree;
  fine_.resize(tree.nodes.size());
  for (std::size_t i = tree.nodes.size(); i-- > 0;) {  // children come after their parents
    const Node& node = tree.nodes[i];
    FineBox& box = fine_[i];
    for (int k = 0; k < 3; ++k) box.low[k] = INFINITY, box.high[k] = -INFINITY;
    const auto include = [&](const double* low, const double* high) {
      for (int k = 0; k < 3; ++k)
        box.low[k] = std::min(box.low[k], low[k]), box.high[k] = std::max(box.high[k], high[k]);
    };
    if (node.children) {
      for (const std::uint32_t child : {node.children, node.children + 1}) include(fine_[child].low, fine_[child].high);
      continue;
    }
    const LeafRange& leaf = tree.leaves[node.leaf];
    for (std::uint32_t c = leaf.first_corner; c < leaf.end_corner; ++c) {
      const double* x = mesh_.snapshot.vertices[tree.corners[c]].t0;
      include(x, x);
    }
  }
}

// Sets scale_ so that the largest distance of the point from the mesh is between 1 and 4.
void NearestFaceSearch::begin(const Vec3<double>& point) {
  point_ = point;
  const Extent& extent = mesh_.snapshot.extent_of_mesh(mesh_.mesh);
  const double at[3] = {point.x, point.y, point.z};
  double most = 0;
  for (int k = 0; k < 3; ++k)
    most = std::max({most, std::fabs(extent.low[k] - at[k]), std::fabs(extent.high[k] - at[k])});
  scale_ = scale_for(most);
}

NearestFace NearestFaceSearch::find(const Vec3<double>& point, std::uint32_t near) {
  begin(point);
  const Extent& extent = mesh_.snapshot.extent_of_mesh(mesh_.mesh);
  const double at[3] = {point.x, point.y, point.z};
  double size = 0, away = 0, nearer[3], center[3];
  for (int k = 0; k < 3; ++k) {
    center[k] = 0.5 * extent.low[k] + 0.5 * extent.high[k];
    size = std::max(size, extent.high[k] - extent.low[k]);
    away = std::max(away, std::fabs(at[k] - center[k]));
  }
  const bool far = away / far_away > size;
  for (int k = 0; k < 3; ++k) nearer[k] = far ? center[k] + (at[k] - center[k]) * (near_enough * size / away) : at[k];
  if (far) begin({nearer[0], nearer[1], nearer[2]});

  square_ = limit_ = reach_ = INFINITY, face_ = Tree::none;
  if (!fine_.empty()) {
    slack_ = 0;
    if (near != Tree::none) consider(near);
    search_fine();
  } else {
    const CoordinateMap& map = mesh_.snapshot.map;
    double mapped[3], most = 0;
    for (int k = 0; k < 3; ++k) mapped[k] = map.precise(nearer[k], k), most = std::max(most, std::fabs(mapped[k]));
    // Mapped vertices are within 2.25 of zero: floats round them by 1.2e-7 at most, a point within 8 by 2.4e-7, and
    // their difference by 4.8e-7; times the root of three. In doubles only the first remains.
    constexpr double within_floats = 8;
    const bool floats = most <= within_floats;
    slack_ = floats ? 1.5e-6 : 2.1e-7 + 1e-15 * most;
    // A distance along a direction adds seven roundings of three products, and the direction is a unit vector within 3.
    along_slack_ = slack_ + (floats ? 10 * 0x1p-24 : 10 * 0x1p-53) * 3 * (most + 2.25);
    if (near != Tree::none) consider(near);
    if (floats)
      search<float>({static_cast<float>(mapped[0]), static_cast<float>(mapped[1]), static_cast<float>(mapped[2])});
    else
      search<double>(mapped);
  }

  if (far) begin(point), square_ = square_of_distance(face_, INFINITY);
  NearestFace found{std::sqrt(square_) / scale_, face_, nearest_point(face_), largest_scaled_error / scale_};
  if (found.distance == 0) {
    const std::array<std::uint32_t, 3>& f = mesh_.features.faces[face_];
    const Vec3<double> q[4] = {point, mesh_.position(f[0]), mesh_.position(f[1]), mesh_.position(f[2])};
    found.distance = exact::distance(Kind::vertex_face, q);
  }
  return found;
}

void NearestFaceSearch::consider(std::uint32_t face) {
  const double s = square_of_distance(face, square_);
  if (s > square_ || (s == square_ && face >= face_)) return;
  const bool nearer = s < square_;
  square_ = s, face_ = face;
  if (nearer) update_limit();
}

// Faces at the same distance are still needed: one of them has the lowest number.
void NearestFaceSearch::update_limit() {
  const double units = fine_.empty() ? mesh_.snapshot.map.scale / scale_ : 1;
  const double distance = (std::sqrt(square_) * (1 + 1e-9) + largest_scaled_error) * units, limit = distance + slack_;
  reach_ = distance + along_slack_;
  limit_ = limit * limit * (1 + 1e-6);  // the square of a gap is rounded in single precision
}

ScaledFace NearestFaceSearch::scaled(std::uint32_t face) const {
  const auto& f = mesh_.features.faces[face];
  const SortedFace sorted(f[0], f[1], f[2]);
  const Vec3<double> at[3] = {mesh_.position(sorted.vertex[0]), mesh_.position(sorted.vertex[1]),
                              mesh_.position(sorted.vertex[2])};
  return {point_, scale_, at};
}

double NearestFaceSearch::square_of_distance(std::uint32_t number, double least) const {
  const ScaledFace face = scaled(number);
  const PlaceOnFace place = face.nearest();
  if (place.certain) return place.square;
  if (std::sqrt(place.square) - face.height_of_needle() - largest_scaled_error > std::sqrt(least)) return place.square;
  const Vec3<double> pair[4] = {point_, face.at[0], face.at[1], face.at[2]};
  const double exact = exact::distance(Kind::vertex_face, pair) * scale_;
  return exact * exact;
}

Vec3<double> NearestFaceSearch::nearest_point(std::uint32_t number) const {
  const ScaledFace face = scaled(number);
  const PlaceOnFace place = face.nearest();
  if (place.certain) return face.point_at(place);
  const Vec3<double> pair[4] = {point_, face.at[0], face.at[1], face.at[2]};
  return exact::nearest(Kind::vertex_face, pair).on_second;
}

template <class Real>
void NearestFaceSearch::search(const Real (&at)[3]) {
  const Tree& tree = mesh_.tree;
  const auto square_of_gap = [&](std::uint32_t number) {
    return static_cast<double>(hpccd::square_of_gap(tree.nodes[number], at));
  };
  stack_.clear();
  stack_.push_back({0, 0});
  while (!stack_.empty()) {
    const auto [number, gap] = stack_.back();
    stack_.pop_back();
    const Node& node = tree.nodes[number];
    if (gap > limit_ || !mesh_.may_be_below(node)) continue;
    if (Tree::in_block(node)) {
      search_block(tree.blocks[tree.block_of_leaf[node.leaf]], at);
      continue;
    }
    Pending near{node.children, square_of_gap(node.children)}, far{node.children + 1, square_of_gap(node.children + 1)};
    if (far.square_of_gap < near.square_of_gap) std::swap(near, far);
    if (far.square_of_gap <= limit_) stack_.push_back(far);
    if (near.square_of_gap <= limit_) stack_.push_back(near);
  }
}

template <class Real>
void NearestFaceSearch::search_block(const Block& block, const Real (&at)[3]) {
  Real gaps[Block::width];
  squares_of_gaps(block, at, gaps);
  for (std::uint32_t left = block.n_leaves; left > 0; --left) {
    const Real* least = std::min_element(gaps, gaps + block.n_leaves);
    if (!(*least <= limit_)) return;
    const auto i = static_cast<std::uint32_t>(least - gaps);
    gaps[i] = INFINITY;
    search_leaf(block.first_leaf + i, at);
  }
}

// A face is not nearer than its corners are along any direction. That towards the middle of the leaf excludes most
// faces whose boxes are near: across it, distances differ from those along it only by squares.
template <class Real>
void NearestFaceSearch::search_leaf(std::uint32_t number, const Real (&at)[3]) {
  const Tree& tree = mesh_.tree;
  const LeafRange& leaf = tree.leaves[number];
  const Box& box = tree.node_of_leaf(number).box.t0;
  Real u[3], square = 0;
  for (int k = 0; k < 3; ++k) u[k] = Real(0.5) * (Real(box.low[k]) + Real(box.high[k])) - at[k], square += u[k] * u[k];
  const Real per_length = square > Real(1e-30) ? 1 / std::sqrt(square) : Real(0);
  for (Real& x : u) x *= per_length;
  Real along[2 * CornerRow::width];
  const CornerRow* rows = tree.rows_of(leaf);
  for (std::uint32_t g = 0; g < leaf.n_groups(); ++g, rows += tree.rows_per_group())
    distances_along(rows, at, u, along + g * CornerRow::width);
  const CornersOf& corners = tree.corners_of[number];
  for (std::uint32_t i = 0; i < leaf.n_faces(); ++i) {
    const Real least = std::min({along[corners.face[0][i]], along[corners.face[1][i]], along[corners.face[2][i]]});
    if (least <= reach_) consider(tree.face_of_slot[leaf.first_face + i]);
  }
}

void NearestFaceSearch::search_fine() {
  const Tree& tree = mesh_.tree;
  const double at[3] = {point_.x, point_.y, point_.z};
  const auto square_of_gap = [&](std::uint32_t number) {
    double s = 0;
    for (int k = 0; k < 3; ++k) {
      const double gap = scale_ * beyond(fine_[number].low[k], fine_[number].high[k], at[k]);
      s += gap * gap;
    }
    return s;
  };
  stack_.clear();
  stack_.push_back({0, 0});
  while (!stack_.empty()) {
    const auto [number, gap] = stack_.back();
    stack_.pop_back();
    const Node& node = tree.nodes[number];
    if (gap > limit_ || !mesh_.may_be_below(node)) continue;
    if (!node.children) {
      const LeafRange& leaf = tree.leaves[node.leaf];
      for (std::uint32_t slot = leaf.first_face; slot < leaf.end_face; ++slot) consider(tree.face_of_slot[slot]);
      continue;
    }
    Pending near{node.children, square_of_gap(node.children)}, far{node.children + 1, square_of_gap(node.children + 1)};
    if (far.square_of_gap < near.square_of_gap) std::swap(near, far);
    stack_.push_back(far), stack_.push_back(near);
  }
}

}  // namespace hpccd
