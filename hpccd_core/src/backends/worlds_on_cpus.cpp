// SPDX-License-Identifier: Apache-2.0
#include "backends/worlds_on_cpus.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <numeric>
#include <utility>

namespace hpccd {
namespace {

// The number of worlds that get one thread each. If the remaining worlds would leave most threads idle, each of them
// gets all threads, one world after the other; with four or more worlds per thread this would save little.
std::size_t n_side_by_side(std::size_t worlds, std::size_t threads) {
  const std::size_t rest = worlds % threads;
  return worlds >= 4 * threads || 2 * rest > threads ? worlds : worlds - rest;
}

}  // namespace

std::size_t WorldMemories::bytes() const {
  std::size_t n = 0;
  for (const WorldMemory& m : of_world) n += m.bytes();
  return n;
}

WorldsOnCpus::WorldsOnCpus(Resources& shared, CpuBackend& on_all_threads, WorldMemories& memories)
    : WorldByWorld(shared),
      on_all_threads_(on_all_threads),
      memories_(memories),
      engines_(static_cast<std::size_t>(shared.pool.size())) {
  one_thread_.heed(shared.cancellation);
}

bool WorldsOnCpus::each_world(const Ask& ask) {
  on_all_threads_.begin_worlds();
  for (const auto& e : engines_)
    if (e) e->backend.begin_worlds(), e->working = false;
  const std::size_t side_by_side = n_side_by_side(n_worlds(), engines_.size());
  order(side_by_side);
  std::atomic<std::size_t> next{0};
  shared_.pool.share([&](int thread) {
    for (std::size_t i; (i = next.fetch_add(1, std::memory_order_relaxed)) < side_by_side;) {
      shared_.cancellation.heed();
      const std::size_t k = order_[i];
      Engine& engine = engine_of(thread);
      const auto begin = std::chrono::steady_clock::now();
      const WorldVisit visit(engine.backend, memories_, k);
      ask(engine.backend, k);
      memories_.of_world[k].seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    }
  });
  mark_stages();
  for (std::size_t k = side_by_side; k < n_worlds(); ++k) {
    const WorldVisit visit(on_all_threads_, memories_, k);
    ask(on_all_threads_, k);
  }
  return true;  // the CPU supports all queries
}

// Worlds that took longest last time come first, so that the work is short when threads run out of worlds.
void WorldsOnCpus::order(std::size_t side_by_side) {
  order_.resize(side_by_side);
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  std::ranges::stable_sort(order_, std::greater<>(), [&](std::size_t k) { return memories_.of_world[k].seconds; });
}

WorldsOnCpus::Engine& WorldsOnCpus::engine_of(int thread) {
  auto& engine = engines_[static_cast<std::size_t>(thread)];
  if (!engine) {
    engine = std::make_unique<Engine>(shared_.common, one_thread_);
    engine->backend.begin_worlds();
  }
  if (!std::exchange(engine->working, true)) engine->resources.profiler.begin();
  return *engine;
}

// Threads work side by side: their share of the wall-clock time is their share of the threads' time.
void WorldsOnCpus::mark_stages() {
  shared_.profiler.mark("waiting");
  for (const auto& e : engines_) {
    if (!e || !e->working) continue;
    for (const auto& [name, ms] : e->resources.profiler.stages())
      shared_.profiler.mark_split("waiting", name.c_str(), ms / static_cast<double>(engines_.size()));
  }
}

void WorldsOnCpus::count(std::map<std::string, std::uint64_t>& stats) const {
  on_all_threads_.count(stats);
  for (const auto& e : engines_) {
    if (!e) continue;
    e->backend.count(stats);
    stats["bytes"] += e->resources.tree.bytes();
  }
  stats["bytes"] += memories_.bytes();
}

}  // namespace hpccd
