// SPDX-License-Identifier: Apache-2.0
// Resources that the backends of one detector share, so that each step can use another backend.
#pragma once

#include <memory>

#include "backends/moving_tree.h"
#include "base/cancellation.h"
#include "base/parallel.h"
#include "base/profiler.h"
#include "elementary/distance/separations.h"
#include "scene/features.h"
#include "scene/separation_table.h"
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
  PairRules rules;

  // At the beginning of each call: applies separations that were set since the last one.
  void settle();
  // The current separations, for tests.
  Separations separations_now() const;

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
};

}  // namespace hpccd
