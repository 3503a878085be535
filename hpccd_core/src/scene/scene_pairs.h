// SPDX-License-Identifier: Apache-2.0
// Lists the values that are set for single pairs of meshes or of features. Enumerating all pairs would take the square
// of the number of meshes.
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
  // Filters below the mesh (scene/feature_filter.h).
  const auto& rings() const { return scene_.rings_; }
  const auto& rest() const { return scene_.rest_; }
  const auto& ignored_faces() const { return scene_.ignored_faces_; }
  const auto& ignored_vf() const { return scene_.ignored_vf_; }
  const auto& ignored_ee() const { return scene_.ignored_ee_; }
  const auto& ignored_ef() const { return scene_.ignored_ef_; }

 private:
  const Scene& scene_;
};

}  // namespace v0_1
}  // namespace hpccd
