// SPDX-License-Identifier: Apache-2.0
// Resources that the backends of one detector share, so that each step can use another backend.
#pragma once

#include <memory>

#include "backends/moving_tree.h"
#include "backends/planes.h"
#include "base/cancellation.h"
#include "base/parallel.h"
#include "base/profiler.h"
#include "elementary/distance/separations.h"
#include "scene/feature_filter.h"
#include "scene/features.h"
#include "scene/separation_table.h"
#include "scene/thickness.h"
#include "traverse/tasks.h"

namespace hpccd {

// Shared by all worlds of a detector.
struct Common {
  // `threads` as for ThreadPool; the options contain the actual number.
  Common(std::shared_ptr<const Scene> of, const Options& wanted, int threads);

  std::shared_ptr<const Scene> scene;
  Options options;
  Cancellation cancellation;
  ThreadPool pool;
  Features features;
  SeparationTable separations;
  ThicknessTable thickness;
  PairRules rules;
  FeatureFilter filter;
  Planes planes;

  // At the beginning of each call: applies separations that were set since the last one.
  void settle();
  // The current separations, for tests.
  Separations separations_now() const;
  bool any_separation() const { return separations.any() || thickness.any(); }
  // By how much the boxes of a motion grow.
  Growth growth() const {
    return {separations.largest(), thickness.view().of_vertex, thickness.largest_of_meshes(), thickness.version()};
  }
  // An upper bound of the separation of two features.
  double most_separation() const { return (separations.most() + thickness.most_of_two()) * (1 + 1e-15); }
  // Differs between any two states in which the separation of two features differs.
  std::uint64_t version_of_separations() const { return separations.version() + thickness.version(); }

 private:
  std::uint64_t settled_;  // version of the separations
};

// For the world that is computed now, by the threads of this pool.
struct Resources {
  Resources(Common& all, ThreadPool& threads);
  Resources(const Resources&) = delete;
  Resources& operator=(const Resources&) = delete;

  Common& common;
  const std::shared_ptr<const Scene>& scene;
  const Options& options;
  const Cancellation& cancellation;
  ThreadPool& pool;
  const Features& features;
  const SeparationTable& separations;
  const PairRules& rules;
  MovingTree tree;
  Profiler profiler;

  Separations separations_now() const { return common.separations_now(); }
  double most_separation() const { return common.most_separation(); }
};

}  // namespace hpccd
