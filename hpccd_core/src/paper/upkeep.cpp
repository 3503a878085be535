// SPDX-License-Identifier: Apache-2.0
#include "paper/upkeep.h"

#include <atomic>

#include "paper/build.h"
#include "paper/refit.h"

namespace hpccd::paper {

void Upkeep::begin_step(const std::vector<Box>& vertex_boxes, ThreadPool& pool, Profiler& profiler) {
  ++step_;
  if (whole_)
    refit(h_, features_, vertex_boxes, pool);
  else
    build(h_, features_, vertex_boxes, pool);
  profiler.mark(whole_ ? "refit" : "build");
  whole_ = false;
}

bool Upkeep::worn(NodeIndex n) const {
  const Node& node = h_.nodes[n];
  // The two or three triangles of a smaller node cannot be arranged much better.
  constexpr std::uint32_t smallest = 4;
  // The ratio of surfaces is between about 0.7 and 2. On n-body-like-lr a step visits 1.85 million pairs of nodes
  // without restructuring; 1.78, 1.37 and 1.18 million with 1.5, 1.25 and 1.1, which restructure or split 85, 2,700 and
  // 11,800 nodes.
  constexpr float worse = 1.25f;
  return node.count >= smallest && culling_inefficiency(h_, n) > worse * node.culling_when_split;
}

void Upkeep::make_children(NodeIndex n, UpkeepCounts& counts) {
  if (!h_.nodes[n].is_split) {
    h_.split(n, features_);
    ++counts.split_lazily;
  } else if (restructure_ && worn(n)) {
    h_.split(n, features_);
    ++counts.restructured;
  }
}

void Upkeep::examine(NodeIndex n, UpkeepCounts& counts) {
  if (h_.nodes[n].examined == step_) return;
  make_children(n, counts);
  h_.nodes[n].examined = step_;
}

void Upkeep::examine_locked(NodeIndex n, UpkeepCounts& counts) {
  std::atomic_ref<std::uint32_t> examined(h_.nodes[n].examined);
  if (examined.load(std::memory_order_acquire) == step_) return;
  std::unique_lock lock(locks_[n % locks_.size()], std::try_to_lock);
  if (!lock.owns_lock()) {
    ++counts.lock_waits;
    lock.lock();
  }
  if (examined.load(std::memory_order_relaxed) == step_) return;
  make_children(n, counts);
  examined.store(step_, std::memory_order_release);
}

void add_counts(std::map<std::string, std::uint64_t>& stats, const UpkeepCounts& counts) {
  stats["nodes_restructured"] += counts.restructured;
  stats["nodes_split_lazily"] += counts.split_lazily;
  stats["lock_waits"] += counts.lock_waits;
}

}  // namespace hpccd::paper
