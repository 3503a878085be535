// SPDX-License-Identifier: Apache-2.0
// Lists the values that are set for single pairs of meshes. Enumerating all pairs would take the square of the number
// of meshes.
#pragma once

#include "hpccd/hpccd.h"

namespace hpccd {
inline namespace v0_1 {

class ScenePairs {
 public:
  explicit ScenePairs(const Scene& scene) : scene_(scene) {}
  const auto& ignored() const { return scene_.ignored_; }
  const auto& accuracy() const { return scene_.accuracy_; }
  const auto& separation() const { return scene_.separation_; }
  const auto& features() const { return scene_.features_; }

 private:
  const Scene& scene_;
};

}  // namespace v0_1
}  // namespace hpccd
