// SPDX-License-Identifier: Apache-2.0
#include "traverse/tasks.h"

namespace hpccd {
namespace {

// At the other tiers what is reported may not touch at all.
bool tells_times(Rule rule) {
  return rule.separated || rule.accuracy == Accuracy::exact || rule.accuracy == Accuracy::conservative;
}

}  // namespace

PairRules::PairRules(const Scene& scene, Accuracy accuracy, const SeparationTable& separations, TestedFeatures features)
    : n_(scene.meshes().size()) {
  enabled_.resize(n_ * n_);
  accuracy_.resize(n_ * n_);
  features_.resize(n_ * n_);
  for (std::uint32_t a = 0; a < n_; ++a)
    for (std::uint32_t b = 0; b < n_; ++b) {
      enabled_[a * n_ + b] = scene.pair_enabled(a, b);
      accuracy_[a * n_ + b] = scene.pair_accuracy(a, b, accuracy);
      features_[a * n_ + b] = scene.pair_features(a, b, features);
      all_enabled_ = all_enabled_ && enabled_[a * n_ + b];
    }
  change(separations);
}

void PairRules::change(const SeparationTable& separations) {
  rules_.resize(n_ * n_);
  bool all_default = true;
  promise_times_ = true, any_fast_ = false;
  for (std::uint32_t a = 0; a < n_; ++a)
    for (std::uint32_t b = 0; b < n_; ++b) {
      const std::size_t i = a * n_ + b;
      rules_[i] = {accuracy_[i], separations.of(a, b) > 0, features_[i]};
      if (enabled(a, b)) {
        promise_times_ = promise_times_ && tells_times(rules_[i]);
        any_fast_ = any_fast_ || (rules_[i].accuracy == Accuracy::fast && !rules_[i].separated);
      }
      all_default = all_default && rules_[i] == rules_[0];
    }
  if (!rules_.empty()) default_ = rules_[0];
  if (all_default) rules_.clear();
}

}  // namespace hpccd
