// SPDX-License-Identifier: Apache-2.0
// Data on the device that lasts as long as the scene: features, meshes, rules between them, and the numbering of
// pairs.
#pragma once

#include <algorithm>
#include <vector>

#include "gpu/device.h"
#include "gpu/launch_params.cuh"
#include "gpu/stream.h"
#include "scene/feature_filter.h"
#include "scene/features.h"
#include "scene/scene_pairs.h"
#include "scene/separation_table.h"
#include "scene/tested_pairs.h"
#include "scene/thickness.h"

namespace hpccd::gpu {

class DeviceScene {
 public:
  // On the current device. Throws Error if the scene has too many features for 31-bit numbers.
  DeviceScene(const Scene& scene, const Features& features, Accuracy accuracy, TestedFeatures tested,
              const SeparationTable& separations, const ThicknessTable& thickness, const FeatureFilter& filter,
              u32 n_worlds)
      : features_(features), separations_(separations), thickness_(thickness), n_worlds_(n_worlds) {
    const auto n_edges = features.edges.size();
    if (std::max<std::size_t>({features.n_vertices, n_edges, features.n_faces()}) * n_worlds >= kind_bit)
      throw Error("the scene has 2^31 or more features of one kind in all worlds; use backend=\"cpu\"");
    upload(edges_, features.edges.data(), n_edges);
    upload(faces_, features.faces.data(), 3 * features.faces.size());
    upload(mesh_of_vertex_, features.mesh_of_vertex.data(), features.mesh_of_vertex.size());
    upload_rules(scene, accuracy);
    upload_tested(scene, tested);
    upload_filter(scene, filter);
    if (with_points()) upload(edge_kinds_, features.edge_kinds.data(), n_edges);
    keys_ = PairKeys::of(features.n_vertices, n_edges, features.n_faces(), n_worlds);
  }

  template <class T>
  void fill(LaunchParams<T>& params) const {
    params.n_worlds = n_worlds_;
    params.n_vertices = features_.n_vertices, params.n_edges = static_cast<u32>(features_.edges.size());
    if (n_worlds_ > 1) {
      params.by_vertices = Division::by(std::max(params.n_vertices, 1u));
      params.by_edges = Division::by(std::max(params.n_edges, 1u));
    }
    params.edges = edges_.data(), params.faces = faces_.data(), params.mesh_of_vertex = mesh_of_vertex_.data();
    params.n_meshes = n_meshes_;
    params.enabled = all_enabled_ ? nullptr : enabled_.data();
    params.accuracy = one_accuracy_ ? nullptr : accuracy_.data();
    params.default_accuracy = default_accuracy_;
    params.features = one_tested_ ? nullptr : tested_.data();
    params.default_features = default_tested_;
    params.edge_kinds = edge_kinds_.size() ? edge_kinds_.data() : nullptr;
    params.filtered = filtered_.size() ? filtered_.data() : nullptr;
    if (params.filtered) {
      const auto rows = [&](std::size_t table) {
        return first_[table].size() ? RowsView{first_[table].data(), values_[table].data()} : RowsView{};
      };
      using F = FeatureFilter;
      params.filter = {reinterpret_cast<const u32*>(params.edges),
                       params.faces,
                       params.mesh_of_vertex,
                       rows(F::near),
                       rows(F::vf),
                       rows(F::ee),
                       rows(F::ef),
                       rows(F::vertex_against),
                       rows(F::edge_against),
                       rows(F::face_against)};
    }
    params.keys = keys_;
  }

  // The query of a frame of motions, by the separations of the last update_separations().
  Query query_now() const { return any_separation_ ? Query::separations : Query::contacts; }
  bool all_fast() const { return all_fast_; }  // all pairs that are tested
  // Copies the separations to the device if they have changed; must be called before a frame of motions.
  void update_separations() {
    any_separation_ = separations_.any() || thickness_.any(), one_separation_ = separations_.uniform();
    separation_ = any_separation_ && one_separation_ ? separations_.first() : 0;
    by_mesh_ = separations_.any(), thick_ = thickness_.any();
    update_thickness();
    if (!separations_.any() || separations_.version() == uploaded_) return;
    uploaded_ = 0;  // invalid, if this fails
    if (!one_separation_) {
      const std::vector<double> all = of_all_pairs<double>([&](u32 a, u32 b) { return separations_.of(a, b); });
      upload(pair_separation_, all.data(), all.size());
    }
    upload(largest_separation_, separations_.largest().data(), separations_.largest().size());
    uploaded_ = separations_.version();
  }
  // For frames of this query.
  template <class T>
  void fill_separations(LaunchParams<T>& params) const {
    const bool any = query_now() == Query::separations;
    params.separation = separation_;
    params.separations = any && !one_separation_ ? pair_separation_.data() : nullptr;
    params.largest_separation = by_mesh_ ? largest_separation_.data() : nullptr;
    fill_thickness(params);
  }
  // As at the last update_separations().
  Thicknesses thickness() const {
    return thick_ ? Thicknesses{vertex_thickness_.data(), edge_thickness_.data(), face_thickness_.data()}
                  : Thicknesses{};
  }
  template <class T>
  void fill_thickness(LaunchParams<T>& params) const {
    params.thickness = thickness();
  }
  // Changes with every value that fill_separations writes.
  u64 separations_version() const { return separations_.version() + thickness_.version(); }

  const PairKeys& keys() const { return keys_; }
  std::size_t bytes() const {
    std::size_t of_filter = filtered_.bytes();
    for (std::size_t i = 0; i < FeatureFilter::n_tables; ++i) of_filter += first_[i].bytes() + values_[i].bytes();
    return of_filter + edge_kinds_.bytes() + edges_.bytes() + faces_.bytes() + mesh_of_vertex_.bytes() +
           enabled_.bytes() + accuracy_.bytes() + tested_.bytes() + pair_separation_.bytes() +
           largest_separation_.bytes() + vertex_thickness_.bytes() + edge_thickness_.bytes() + face_thickness_.bytes();
  }

 private:
  // Devices look up pairs in a table of all pairs, unless all values are the same.
  template <class V, class OfPair>
  std::vector<V> of_all_pairs(OfPair&& of_pair) const {
    std::vector<V> all(std::size_t{n_meshes_} * n_meshes_);
    for (u32 a = 0; a < n_meshes_; ++a)
      for (u32 b = 0; b < n_meshes_; ++b) all[std::size_t{a} * n_meshes_ + b] = of_pair(a, b);
    return all;
  }
  void upload_pairs(DeviceBuffer<unsigned char>& to, const std::vector<unsigned char>& all) {
    upload(to, all.data(), all.size());
  }

  void update_thickness() {
    if (!thickness_.any() || thickness_.version() == uploaded_thickness_) return;
    uploaded_thickness_ = 0;
    const Thicknesses now = thickness_.view();
    upload(vertex_thickness_, now.of_vertex, features_.n_vertices);
    upload(edge_thickness_, now.of_edge, features_.edges.size());
    upload(face_thickness_, now.of_face, features_.n_faces());
    uploaded_thickness_ = thickness_.version();
  }

  void upload_rules(const Scene& scene, Accuracy accuracy) {
    default_accuracy_ = accuracy;
    n_meshes_ = static_cast<u32>(scene.meshes().size());
    const TestedPairs enabled(scene);
    all_enabled_ = enabled.all();
    std::size_t n_said = 0;
    for (const auto& [pair, tier] : ScenePairs(scene).accuracy()) {
      one_accuracy_ = one_accuracy_ && tier == accuracy;
      if (!enabled.of(pair.first, pair.second)) continue;
      all_fast_ = all_fast_ && tier == Accuracy::fast;
      ++n_said;
    }
    if (n_said < enabled.n_pairs()) all_fast_ = all_fast_ && accuracy == Accuracy::fast;
    if (!all_enabled_)
      upload_pairs(enabled_, of_all_pairs<unsigned char>([&](u32 a, u32 b) { return enabled.of(a, b); }));
    if (!one_accuracy_)
      upload_pairs(accuracy_, of_all_pairs<unsigned char>([&](u32 a, u32 b) {
                     return static_cast<unsigned char>(scene.pair_accuracy(a, b, accuracy));
                   }));
  }

  void upload_tested(const Scene& scene, TestedFeatures otherwise) {
    const auto bits = [](TestedFeatures f) {
      return static_cast<unsigned char>((f.vertex_face ? tests_vertex_face : 0) | (f.edge_edge ? tests_edge_edge : 0));
    };
    default_tested_ = bits(otherwise);
    for (const auto& [pair, features] : ScenePairs(scene).features())
      one_tested_ = one_tested_ && features == otherwise;
    one_tested_ = one_tested_ && !with_points();
    if (one_tested_) return;
    upload_pairs(tested_, of_all_pairs<unsigned char>([&](u32 a, u32 b) {
                   TestedFeatures f = scene.pair_features(a, b, otherwise);
                   if (with_points() && all_never_paired(kinds_of_edges(a), kinds_of_edges(b))) f.edge_edge = false;
                   return bits(f);
                 }));
  }

  bool with_points() const { return !features_.edge_kinds.empty(); }
  unsigned kinds_of_edges(u32 mesh) const { return features_.edge_kinds_of_mesh[mesh]; }

  void upload_filter(const Scene& scene, const FeatureFilter& filter) {
    if (!filter.any() && !with_points()) return;
    std::vector<unsigned char> filtered(std::size_t{n_meshes_} * n_meshes_, false);
    if (with_points())
      filtered = of_all_pairs<unsigned char>(
          [&](u32 a, u32 b) { return some_never_paired(kinds_of_edges(a), kinds_of_edges(b)); });
    for (const auto& [a, b] : filtered_pairs(scene))
      filtered[std::size_t{a} * n_meshes_ + b] = filtered[std::size_t{b} * n_meshes_ + a] = true;
    upload_pairs(filtered_, filtered);
    for (std::size_t i = 0; i < FeatureFilter::n_tables; ++i) {
      const FeatureFilter::Rows& rows = filter.rows()[i];
      if (rows.first.empty()) continue;  // a buffer is never empty once it is written
      upload(first_[i], rows.first.data(), rows.first.size());
      upload(values_[i], rows.values.data(), rows.values.size());
    }
  }

  const Features& features_;
  const SeparationTable& separations_;
  const ThicknessTable& thickness_;
  const u32 n_worlds_;
  std::uint64_t uploaded_ = 0, uploaded_thickness_ = 0;  // versions on the device
  // At the last update: a prepared detection keeps these values after a later change.
  bool any_separation_ = false, one_separation_ = true, by_mesh_ = false, thick_ = false;
  double separation_ = 0;
  DeviceBuffer<uint2> edges_;
  DeviceBuffer<u32> faces_, mesh_of_vertex_;
  DeviceBuffer<unsigned char> enabled_, accuracy_, tested_;
  DeviceBuffer<unsigned char> filtered_;
  DeviceBuffer<EdgeKind> edge_kinds_;
  DeviceBuffer<u32> first_[FeatureFilter::n_tables], values_[FeatureFilter::n_tables];
  DeviceBuffer<double> pair_separation_, largest_separation_;
  DeviceBuffer<double> vertex_thickness_, edge_thickness_, face_thickness_;
  bool all_enabled_ = true, one_accuracy_ = true, all_fast_ = true, one_tested_ = true;
  unsigned char default_tested_ = 0;
  u32 n_meshes_ = 0;
  PairKeys keys_;
  Accuracy default_accuracy_ = Accuracy::exact;
};

}  // namespace hpccd::gpu
