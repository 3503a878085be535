// SPDX-License-Identifier: Apache-2.0
#include "paper/high_level.h"

#include <deque>

namespace hpccd::paper {

void perform_high_level(const Scenery& s, Upkeep& upkeep, const std::vector<NodeIndex>& nodes, ThreadPool& pool,
                        std::vector<Worker>& workers, std::vector<TaskCounts>& counts) {
  // Costs of pairs differ by orders of magnitude; with this many per thread, the sums are nearly equal. In relevant
  // scenes less than one pair in a thousand is visited here, on one thread.
  constexpr std::size_t pairs_per_thread = 256;
  const auto k = static_cast<std::size_t>(pool.size());
  std::deque<Pair> queue;
  for (NodeIndex n : nodes) {
    ++counts[0].units;
    if (enabled(s, {n, n})) queue.push_back({Hierarchy::left(n), s.hierarchy.right(n)});
  }
  while (!queue.empty() && queue.size() < k * pairs_per_thread) {
    const Pair p = queue.front();
    queue.pop_front();
    visit(
        s, p, workers[0], [&](NodeIndex n) { upkeep.examine(n, counts[0].upkeep); },
        [&](Pair q) { queue.push_back(q); });
  }
  if (queue.empty()) return;
  pool.run([&](int thread) {
    Worker& worker = workers[thread];
    UpkeepCounts& upkeep_counts = counts[thread].upkeep;
    std::vector<Pair> pairs;
    for (std::size_t i = thread; i < queue.size(); i += k) {
      pairs.push_back(queue[i]);
      while (!pairs.empty()) {
        const Pair p = pairs.back();
        pairs.pop_back();
        visit(
            s, p, worker, [&](NodeIndex n) { upkeep.examine_locked(n, upkeep_counts); },
            [&](Pair q) { pairs.push_back(q); });
      }
    }
  });
}

}  // namespace hpccd::paper
