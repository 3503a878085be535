// SPDX-License-Identifier: Apache-2.0
#include "scene/pair_rules.h"

#include "scene/feature_filter.h"

namespace hpccd {
namespace {

// At the other tiers, reported pairs may not touch at all.
bool tells_times(Rule rule) {
  return rule.separated || rule.accuracy == Accuracy::exact || rule.accuracy == Accuracy::conservative;
}

}  // namespace

PairRules::PairRules(const Scene& scene, Accuracy accuracy, const SeparationTable& separations, TestedFeatures features)
    : tested_(scene), rules_(scene.meshes().size(), {accuracy, separations.otherwise() > 0, features}) {
  if (tested_.n_pairs() > 0) n_with_rule_[rules_.otherwise()] = tested_.n_pairs();
  const ScenePairs given(scene);
  const auto set_all = [&](const auto& pairs, auto&& change) {
    for (const auto& [pair, value] : pairs) {
      Rule rule = rules_.of(pair.first, pair.second);
      change(rule, pair, value);
      set(pair.first, pair.second, rule);
    }
  };
  set_all(given.accuracy(), [](Rule& rule, const auto&, Accuracy value) { rule.accuracy = value; });
  set_all(given.features(), [](Rule& rule, const auto&, TestedFeatures value) { rule.features = value; });
  for (const auto& [a, b] : filtered_pairs(scene)) {
    Rule rule = rules_.of(a, b);
    rule.filtered = true;
    set(a, b, rule);
  }
  separations.for_pairs([&](std::uint32_t a, std::uint32_t b, double separation) { separate(a, b, separation); });
  look_at_all();
}

void PairRules::set(std::uint32_t a, std::uint32_t b, Rule rule) {
  const Rule before = rules_.of(a, b);
  if (rule == before) return;
  if (!tested_.of(a, b)) return rules_.set(a, b, rule);
  std::size_t& n = n_with_rule_[rule];  // this line and the next may throw bad_alloc: nothing is counted before
  rules_.set(a, b, rule);
  ++n;
  const auto as_before = n_with_rule_.find(before);
  if (--as_before->second == 0) n_with_rule_.erase(as_before);
}

void PairRules::change(const SeparationTable& separations) {
  for (const auto& [a, b] : separations.changed()) separate(a, b, separations.of(a, b));
  look_at_all();
}

void PairRules::separate(std::uint32_t a, std::uint32_t b, double separation) {
  Rule rule = rules_.of(a, b);
  rule.separated = separation > 0;
  set(a, b, rule);
}

void PairRules::look_at_all() {
  promise_times_ = true, any_fast_ = false;
  std::erase_if(n_with_rule_, [](const auto& entry) { return entry.second == 0; });
  for (const auto& [rule, n] : n_with_rule_) {
    promise_times_ = promise_times_ && tells_times(rule);
    any_fast_ = any_fast_ || (rule.accuracy == Accuracy::fast && !rule.separated);
  }
  one_rule_.reset();
  if (n_with_rule_.size() == 1) one_rule_ = n_with_rule_.begin()->first;
}

}  // namespace hpccd
