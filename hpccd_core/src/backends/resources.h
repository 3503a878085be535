// SPDX-License-Identifier: Apache-2.0
// What the backends of one detector share, so that each step can go to another one.
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

struct Resources {
  // `threads` as for ThreadPool; the options say how many there are.
  Resources(std::shared_ptr<const Scene> of, const Options& wanted, int threads);

  std::shared_ptr<const Scene> scene;
  Options options;
  Cancellation cancellation;
  ThreadPool pool;
  Features features;
  SeparationTable separations;
  PairRules rules;
  MovingTree tree;
  Profiler profiler;

  // At the beginning of each call: what follows from separations that were set since the last one.
  void settle();
  // Of this moment, for tests.
  Separations separations_now() const;

 private:
  std::uint64_t settled_;  // version of the separations
};

}  // namespace hpccd
