// SPDX-License-Identifier: Apache-2.0
// The interface of a published method. Each finds the contacts of the default traversal, bit-identical.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "base/profiler.h"
#include "bvh/box.h"
#include "scene/features.h"
#include "scene/pair_rules.h"
#include "traverse/worker.h"

namespace hpccd::paper {

// Data with the lifetime of the detector.
struct Context {
  const Features& features;
  const PairRules& rules;
  ThreadPool& pool;
};

class MethodEngine {
 public:
  virtual ~MethodEngine() = default;
  // Updates the hierarchy to this step's bounds; profiled as "build" or "refit".
  virtual void update(const std::vector<Box>& vertex_boxes, Profiler& profiler) = 0;
  // Leaves the contacts in the workers, one per thread of the pool.
  virtual void traverse(const std::vector<Box>& vertex_boxes, Search& search, std::vector<Worker>& workers) = 0;
  // Adds the counts of the last step.
  virtual void count(std::map<std::string, std::uint64_t>& stats) const = 0;
  virtual std::size_t bytes() const = 0;
};

std::unique_ptr<MethodEngine> published(const Context& context, bool restructure);  // sections 3.3, 4 and 6
std::unique_ptr<MethodEngine> naive(const Context& context, bool restructure);      // section 3.2
std::unique_ptr<MethodEngine> front_based(const Context& context);                  // Tang et al. 2009 (section 6.3)

// The engine of a method; none for Method::standard. Throws InvalidArgument for what the method does not offer.
std::unique_ptr<MethodEngine> engine_of(const Options& options, const Context& context);

}  // namespace hpccd::paper
