// SPDX-License-Identifier: Apache-2.0
// Pairs of features that are within a distance of each other at rest (Scene::ignore_within).
#pragma once

#include "scene/feature_filter.h"

namespace hpccd {

// Found by searches of this engine, each on one mesh alone, at tier exact.
FeaturePairs pairs_at_rest(const Scene& scene, const Features& features, int threads);

}  // namespace hpccd
