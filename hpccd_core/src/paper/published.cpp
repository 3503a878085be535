// SPDX-License-Identifier: Apache-2.0
// The parallel method of Kim et al. 2009 (sections 3.3, 4 and 6), on CPUs.
#include "paper/breadth_first.h"
#include "paper/high_level.h"
#include "paper/method.h"

namespace hpccd::paper {
namespace {

class Published final : public MethodEngine {
 public:
  Published(const Context& context, bool restructure)
      : context_(context),
        upkeep_(context.features, restructure),
        scheduling_(context.pool.size()),
        counts_(static_cast<std::size_t>(context.pool.size())) {}

  void update(const std::vector<Box>& vertex_boxes, Profiler& profiler) override {
    counts_.assign(counts_.size(), {});
    upkeep_.begin_step(vertex_boxes, context_.pool, profiler);
  }

  void traverse(const std::vector<Box>& vertex_boxes, Search& search, std::vector<Worker>& workers) override {
    const Scenery scenery{upkeep_.hierarchy(), context_.features, context_.rules, vertex_boxes};
    for (Worker& w : workers) w.begin(search);
    const auto k = static_cast<std::size_t>(context_.pool.size());
    // High-level nodes are restructured here, before any unit: later, the nodes below would be in use.
    const BreadthFirstFront front = breadth_first_front(upkeep_.hierarchy(), k, [&](NodeIndex n) {
      if (upkeep_.hierarchy().nodes[n].is_leaf() || !enabled(scenery, {n, n})) return false;
      upkeep_.examine(n, counts_[0].upkeep);
      return true;
    });
    perform_low_level(scenery, front.low, workers);
    for (auto level = front.high.rbegin(); level != front.high.rend(); ++level)
      perform_high_level(scenery, upkeep_, *level, context_.pool, workers, counts_);
    context_.pool.run([&](int thread) { workers[thread].flush(); });
    upkeep_.end_step();
  }

  void count(std::map<std::string, std::uint64_t>& stats) const override {
    for (const TaskCounts& c : counts_) {
      add_counts(stats, c.upkeep);
      stats["task_units"] += c.units;
      stats["tasks_reassigned"] += c.nodes_given;
      stats["task_requests"] += c.requests;
    }
  }

  std::size_t bytes() const override { return upkeep_.hierarchy().bytes(); }

 private:
  // Section 4.2: one node of the front for each thread; if there are fewer nodes, a thread starts by requesting work.
  void perform_low_level(const Scenery& scenery, const std::vector<NodeIndex>& assigned, std::vector<Worker>& workers) {
    if (assigned.empty()) return;
    scheduling_.begin();
    context_.pool.run([&](int thread) {
      struct Leave {
        Scheduling& scheduling;
        int thread;
        ~Leave() { scheduling.leave(thread); }  // also after an exception, no thread may wait for this one
      } leave{scheduling_, thread};
      TaskUnits units(scenery, upkeep_, scheduling_, thread, workers[thread], counts_[thread]);
      units.perform_self_cd(static_cast<std::size_t>(thread) < assigned.size() ? assigned[thread] : no_node);
    });
  }

  const Context context_;
  Upkeep upkeep_;
  Scheduling scheduling_;
  std::vector<TaskCounts> counts_;
};

}  // namespace

std::unique_ptr<MethodEngine> published(const Context& context, bool restructure) {
  return std::make_unique<Published>(context, restructure);
}

}  // namespace hpccd::paper
