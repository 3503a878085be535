// SPDX-License-Identifier: Apache-2.0
#include "backends/one_by_one.h"

#include <algorithm>
#include <set>

namespace hpccd {

bool OneByOne::each_world(const Ask& ask) {
  counts_.clear(), stages_.clear();
  beside_.begin_worlds();
  for (std::size_t k = 0; k < n_worlds(); ++k) {
    shared_.cancellation.heed();
    if (one_.failures().gave_up()) return false;
    const WorldVisit visit(beside_, memories_, k);
    if (!ask(one_, k)) return false;
    add_counts();
  }
  return true;
}

void OneByOne::add_counts() {
  // Sizes, which do not add up over worlds.
  static const std::set<std::string> sizes{"bytes", "gpu_bytes", "gpus", "hybrid_most_queued"};
  std::map<std::string, std::uint64_t> counts;
  one_.count(counts);
  for (const auto& [name, n] : counts) {
    std::uint64_t& sum = counts_[name];
    sum = sizes.contains(name) ? std::max(sum, n) : sum + n;
  }
  std::map<std::string, double> stages;
  one_.add_stages(stages);
  for (const auto& [name, ms] : stages) stages_[name] += ms;
}

void OneByOne::count(std::map<std::string, std::uint64_t>& stats) const {
  for (const auto& [name, n] : counts_) stats[name] += n;
  beside_.count(stats);
  stats["bytes"] += memories_.bytes();
}

void OneByOne::add_stages(std::map<std::string, double>& stages) const {
  stages.insert(stages_.begin(), stages_.end());
}

}  // namespace hpccd
