// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, after its header (base/simd/scalar.h). Like batch.inl, must not use the standard
// library at run time.

#include "traverse/far_pairs.h"

namespace hpccd::HPCCD_ISA {
namespace {

#include "traverse/candidate_rows.inl"

constexpr std::uint32_t lanes = sizeof(Single) / sizeof(float);

HPCCD_HD constexpr unsigned first_bits(std::uint32_t n) { return n >= 32 ? ~0u : (1u << n) - 1; }
HPCCD_HD Single all(float x) { return Single(Single::Vec{} + x); }
HPCCD_HD Single load(const float* x) {
  Single r;
  __builtin_memcpy(&r, x, sizeof r);
  return r;
}

// The features of a leaf with n corners each, and their boxes: one row per coordinate, padded with copies of the last
// feature.
template <std::uint32_t n>
struct FeatureRows {
  static constexpr std::uint32_t most = n == 2 ? CornersOf::most_edges : n == 3 ? CornersOf::most_faces : 32;
  static_assert(most % 16 == 0 && Tree::leaf_size * 3 <= 32);
  std::uint32_t size;
  alignas(64) float corner[n][3][most], low[3][most], high[3][most];

  // corner_of(j, i): the number of corner j of feature i.
  template <class CornerOf>
  HPCCD_HD FeatureRows(const Tree& tree, const LeafRange& leaf, std::uint32_t size_, CornerOf&& corner_of)
      : size(size_) {
    const CornerRow* rows = tree.rows_of(leaf);
    const std::uint32_t next_group = tree.rows_per_group();
    for (std::uint32_t i = 0; i < padded(); ++i)
      for (std::uint32_t j = 0; j < n; ++j) {
        const std::uint32_t c = corner_of(j, i < size ? i : size - 1);
        const CornerRow* at = rows + c / CornerRow::width * next_group;
        for (std::uint32_t k = 0; k < 3; ++k) {
          const float x = at[k].lane[c % CornerRow::width];
          corner[j][k][i] = x;
          low[k][i] = j == 0 ? x : lesser(low[k][i], x);
          high[k][i] = j == 0 ? x : greater(high[k][i], x);
        }
      }
  }
  HPCCD_HD std::uint32_t padded() const { return (size + lanes - 1) / lanes * lanes; }
};

// Below this, products of squares are denormal and not reliable.
constexpr float least_square = 1e-20f;

// Bit j: feature j of b is not certainly farther from feature i of a than the root of `square`. If their boxes are
// apart along a direction, the features are farther apart along it than the boxes.
template <std::uint32_t n_a, std::uint32_t n_b>
HPCCD_HD unsigned near_features(const FeatureRows<n_a>& a, std::uint32_t i, const FeatureRows<n_b>& b, float square) {
  unsigned near = 0;
  for (std::uint32_t begin = 0; begin < b.size; begin += lanes) {
    Single gap[3], length(0.0);
    for (std::uint32_t k = 0; k < 3; ++k) {
      const Single behind = load(&b.low[k][begin]) - all(a.high[k][i]),
                   before = all(a.low[k][i]) - load(&b.high[k][begin]);
      gap[k] = greater(behind, Single(0.0)) - greater(before, Single(0.0));
      length = length + gap[k] * gap[k];
    }
    const auto place = [&](auto&& x) { return gap[0] * x(0) + gap[1] * x(1) + gap[2] * x(2); };
    Single farthest = place([&](std::uint32_t k) { return all(a.corner[0][k][i]); });
    for (std::uint32_t j = 1; j < n_a; ++j)
      farthest = greater(farthest, place([&](std::uint32_t k) { return all(a.corner[j][k][i]); }));
    Single nearest = place([&](std::uint32_t k) { return load(&b.corner[0][k][begin]); });
    for (std::uint32_t j = 1; j < n_b; ++j)
      nearest = lesser(nearest, place([&](std::uint32_t k) { return load(&b.corner[j][k][begin]); }));
    const Single apart = nearest - farthest;
    const unsigned far =
        bits((length > all(least_square)) && (apart > Single(0.0)) && (apart * apart > all(square) * length));
    near |= (~far & first_bits(lanes)) << begin;
  }
  return near & first_bits(b.size);
}

template <std::uint32_t n_a, std::uint32_t n_b>
HPCCD_HD void add_near(const FeatureRows<n_a>& a, const std::uint32_t* numbers_a, const FeatureRows<n_b>& b,
                       const std::uint32_t* numbers_b, float square, CandidateBuffer& out) {
  CandidateRows rows;
  for (std::uint32_t i = 0; i < a.size; ++i) rows.add(numbers_a[i], near_features(a, i, b, square));
  rows.append_to(out.first, out.second, out.n, numbers_b, b.size);
}

}  // namespace

// Errors of a gap along a direction: see leaf_hulls.cpp.
void far_pairs(const Tree& tree, const LeafRange& a, const LeafRange& b, TestedFeatures, float reach,
               CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
  constexpr float rounding = 2e-6f;
  const float square = (reach + rounding) * (reach + rounding);
  const auto features_of = [&](const LeafRange& leaf) -> const CornersOf& {
    return tree.corners_of.data()[&leaf - tree.leaves.data()];
  };
  const CornersOf &in_a = features_of(a), &in_b = features_of(b);
  const auto edges_of = [&](const LeafRange& leaf, const CornersOf& in) {
    return FeatureRows<2>(tree, leaf, leaf.n_edges(), [&](std::uint32_t j, std::uint32_t i) { return in.edge[j][i]; });
  };
  const auto faces_of = [&](const LeafRange& leaf, const CornersOf& in) {
    return FeatureRows<3>(tree, leaf, leaf.n_faces(), [&](std::uint32_t j, std::uint32_t i) { return in.face[j][i]; });
  };
  const auto vertices_of = [&](const LeafRange& leaf) {
    return FeatureRows<1>(tree, leaf, leaf.n_vertices(), [](std::uint32_t, std::uint32_t i) { return i; });
  };
  const std::uint32_t *corners = tree.corners.data(), *edges = tree.edge_of_slot.data(),
                      *faces = tree.face_of_slot.data();
  if (a.n_edges() && b.n_edges()) {
    // The edge with the lower number comes first, which is that of the mesh with the lower number.
    const bool in_order = edges[a.first_edge] < edges[b.first_edge];
    const LeafRange &first = in_order ? a : b, &second = in_order ? b : a;
    add_near(edges_of(first, features_of(first)), edges + first.first_edge, edges_of(second, features_of(second)),
             edges + second.first_edge, square, edge_edge);
  }
  if (a.n_vertices() && b.n_faces())
    add_near(vertices_of(a), corners + a.first_corner, faces_of(b, in_b), faces + b.first_face, square, vertex_face);
  if (b.n_vertices() && a.n_faces())
    add_near(vertices_of(b), corners + b.first_corner, faces_of(a, in_a), faces + a.first_face, square, vertex_face);
}

}  // namespace hpccd::HPCCD_ISA
