// SPDX-License-Identifier: Apache-2.0
// The naive parallel method of Kim et al. 2009, section 3.2, the baseline of their Fig. 7: the pairs of one collision
// test pair queue are distributed to the threads, each continues with its own queue, work is redistributed through a
// shared queue, and the reconstruction of any node takes a lock.
#include "paper/method.h"
#include "paper/shared_pairs.h"
#include "paper/upkeep.h"
#include "paper/visit.h"

namespace hpccd::paper {
namespace {

class Naive final : public MethodEngine {
 public:
  Naive(const Context& context, bool restructure)
      : context_(context),
        upkeep_(context.features, restructure),
        counts_(static_cast<std::size_t>(context.pool.size())) {}

  void update(const std::vector<Box>& vertex_boxes, Profiler& profiler) override {
    counts_.assign(counts_.size(), {});
    upkeep_.begin_step(vertex_boxes, context_.pool, profiler);
  }

  void traverse(const std::vector<Box>& vertex_boxes, Search& search, std::vector<Worker>& workers) override {
    const Scenery scenery{upkeep_.hierarchy(), context_.features, context_.rules, vertex_boxes};
    for (Worker& w : workers) w.begin(search);
    const std::vector<Pair> first = first_pairs(scenery, workers[0]);
    const int k = context_.pool.size();
    shared_.begin(k);
    context_.pool.run([&](int thread) {
      try {
        PairQueue own;
        for (std::size_t i = thread; i < first.size(); i += static_cast<std::size_t>(k)) own.push_back(first[i]);
        perform(scenery, own, workers[thread], counts_[thread]);
      } catch (...) {
        shared_.leave();  // no thread may wait for this one
        throw;
      }
      workers[thread].flush();
    });
    upkeep_.end_step();
  }

  void count(std::map<std::string, std::uint64_t>& stats) const override {
    for (const UpkeepCounts& c : counts_) add_counts(stats, c);
    stats["redistributions"] = shared_.redistributions();
  }

  std::size_t bytes() const override { return upkeep_.hierarchy().bytes(); }

 private:
  // Enough pairs that each thread has some, in breadth-first order.
  std::vector<Pair> first_pairs(const Scenery& scenery, Worker& worker) {
    PairQueue queue;
    if (!scenery.hierarchy.nodes.empty()) queue.push_back({0, 0});
    while (!queue.empty() && queue.size() < static_cast<std::size_t>(context_.pool.size())) {
      const Pair p = queue.front();
      queue.pop_front();
      visit(
          scenery, p, worker, [&](NodeIndex n) { upkeep_.examine_locked(n, counts_[0]); },
          [&](Pair q) { queue.push_back(q); });
    }
    return {queue.begin(), queue.end()};
  }

  void perform(const Scenery& scenery, PairQueue& own, Worker& worker, UpkeepCounts& counts) {
    do {
      while (!own.empty()) {
        const Pair p = own.back();
        own.pop_back();
        visit(
            scenery, p, worker, [&](NodeIndex n) { upkeep_.examine_locked(n, counts); },
            [&](Pair q) { own.push_back(q); });
        if (own.size() > 1 && shared_.wanted()) shared_.push_half(own);
      }
    } while (shared_.pop(own));
  }

  const Context context_;
  Upkeep upkeep_;
  SharedPairs shared_;
  std::vector<UpkeepCounts> counts_;
};

}  // namespace

std::unique_ptr<MethodEngine> naive(const Context& context, bool restructure) {
  return std::make_unique<Naive>(context, restructure);
}

}  // namespace hpccd::paper
