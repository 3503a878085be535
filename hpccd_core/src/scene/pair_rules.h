// SPDX-License-Identifier: Apache-2.0
// How each pair of meshes is tested: accuracy, separation and kinds of features, looked up once per call.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "hpccd/hpccd.h"
#include "scene/separation_table.h"
#include "scene/tested_pairs.h"
#include "scene/thickness.h"

namespace hpccd {

// The mesh number of a node with triangles of several meshes.
inline constexpr std::uint32_t mixed_meshes = 0xFFFFFFFFu;

// How the candidates of a pair of meshes are tested.
struct Rule {
  Accuracy accuracy;
  bool separated;  // for a minimum separation above 0, or features that may have a thickness
  TestedFeatures features = {};
  bool filtered = false;  // some pairs of features are ignored (scene/feature_filter.h)

  // Number of the test; independent of which candidates exist.
  unsigned number() const { return static_cast<unsigned>(accuracy) + (separated ? 4 : 0); }
  static Rule of_number(unsigned i) { return {static_cast<Accuracy>(i % 4), i >= 4}; }
  bool operator==(const Rule&) const = default;
  bool operator<(const Rule& other) const { return key() < other.key(); }

 private:
  unsigned key() const {
    return number() + (features.vertex_face ? 8 : 0) + (features.edge_edge ? 16 : 0) + (filtered ? 32 : 0);
  }
};
inline constexpr unsigned n_rules = 8;

class PairRules {
 public:
  PairRules(const Scene& scene, Accuracy accuracy, const SeparationTable& separations, TestedFeatures features = {});
  // Updates the rules of pairs that were set since the table last settled.
  void change(const SeparationTable& separations);
  // Mesh numbers, or mixed_meshes: then some pairs may be enabled.
  bool enabled(std::uint32_t mesh_a, std::uint32_t mesh_b) const {
    if (tested_.all() || mesh_a == mixed_meshes || mesh_b == mixed_meshes) return true;
    return tested_.of(mesh_a, mesh_b);
  }
  bool all_meshes() const { return tested_.all(); }
  bool by_table() const { return tested_.by_table(); }
  // As enabled(), if by_table() is true.
  bool enabled_by_table(std::uint32_t mesh_a, std::uint32_t mesh_b) const {
    return mesh_a == mixed_meshes || mesh_b == mixed_meshes || tested_.in_table(mesh_a, mesh_b);
  }
  // As enabled(), for two meshes: false for planes.
  bool tested(std::uint32_t mesh_a, std::uint32_t mesh_b) const { return tested_.of(mesh_a, mesh_b); }
  // The rule of an enabled pair.
  Rule rule(std::uint32_t mesh_a, std::uint32_t mesh_b) const {
    Rule rule = one_rule_ ? *one_rule_ : rules_.of(mesh_a, mesh_b);
    if (thick_) rule.separated |= thick_[mesh_a] != Thick::none || thick_[mesh_b] != Thick::none;
    return rule;
  }
  // Whether features may have a thickness. Pairs without it are then tested as without a separation (Worker::test), so
  // what follows from all rules remains.
  void set_thick(const std::vector<Thick>& of_meshes) { thick_ = of_meshes.empty() ? nullptr : of_meshes.data(); }
  // Whether every contact has a time within 1e-12, so that pairs that cannot touch before a time can be skipped.
  bool promise_times() const { return promise_times_; }
  // Whether a tested pair has a tier whose results depend on the backend: "fast", without a separation.
  bool any_fast() const { return any_fast_; }
  std::size_t bytes() const { return tested_.bytes() + rules_.bytes(); }

 private:
  void set(std::uint32_t mesh_a, std::uint32_t mesh_b, Rule rule);
  void separate(std::uint32_t mesh_a, std::uint32_t mesh_b, double separation);
  void look_at_all();

  TestedPairs tested_;
  PairTable<Rule> rules_;
  std::map<Rule, std::size_t> n_with_rule_;  // enabled pairs
  std::optional<Rule> one_rule_;             // of all of them
  bool promise_times_ = true, any_fast_ = false;
  const Thick* thick_ = nullptr;  // by mesh; null: none
};

}  // namespace hpccd
