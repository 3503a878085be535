// SPDX-License-Identifier: Apache-2.0
// Pairs of features that are ignored although their meshes are tested: neighbours on a mesh, pairs that are near each
// other at rest, faces against another mesh, single pairs. Compressed rows by feature, which CPUs and devices read
// alike.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/parallel.h"
#include "scene/features.h"
#include "scene/filter_view.h"

namespace hpccd {

// Pairs by numbers of features in the scene; edges of a pair in any order.
struct FeaturePairs {
  std::vector<std::array<std::uint32_t, 2>> vf, ee, ef;
};

class FeatureFilter {
 public:
  FeatureFilter() = default;  // ignores nothing
  // The filters of the scene, and further pairs. Throws InvalidArgument if a row of Scene::ignore_features is no pair
  // of features, or if there are 2^32 pairs or more. Keeps references to the features.
  FeatureFilter(const Scene& scene, const Features& features, FeaturePairs more, ThreadPool& pool);

  bool any() const { return any_; }
  const FilterView& view() const { return view_; }
  // Whether a vertex is ignored against a mesh, or a plane, as a whole.
  bool ignores(std::uint32_t vertex, std::uint32_t mesh) const { return view_.vertex_against.has(vertex, mesh); }
  std::size_t bytes() const;

  struct Rows {
    std::vector<std::uint32_t> first, values;
    RowsView view() const { return first.empty() ? RowsView{} : RowsView{first.data(), values.data()}; }
    std::size_t bytes() const { return (first.capacity() + values.capacity()) * sizeof(std::uint32_t); }
  };
  // In the order of FilterView.
  enum : std::size_t { near, vf, ee, ef, vertex_against, edge_against, face_against, n_tables };
  const std::array<Rows, n_tables>& rows() const { return rows_; }

 private:
  std::array<Rows, n_tables> rows_;
  FilterView view_;
  bool any_ = false;
};

// The edges of a mesh, as numbers in Features::edges: [first, second).
std::array<std::uint32_t, 2> edges_of_mesh(const Features& features, const Scene::Mesh& mesh);

// The pairs of meshes of which some features are ignored.
std::vector<std::array<std::uint32_t, 2>> filtered_pairs(const Scene& scene);

}  // namespace hpccd
