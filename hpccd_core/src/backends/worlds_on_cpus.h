// SPDX-License-Identifier: Apache-2.0
// Many worlds on CPU threads, one thread per world. The data of a step belongs to the thread and stays in the cache of
// its core; little is kept per world from call to call (world_memory.h).
#pragma once

#include <memory>
#include <vector>

#include "backends/cpu_backend.h"
#include "backends/world_by_world.h"

namespace hpccd {

struct WorldMemories {
  explicit WorldMemories(std::size_t worlds) : of_world(worlds), trees(worlds) {}
  std::vector<WorldMemory> of_world;
  TreeBudget trees;
  std::size_t bytes() const;
};

// During the computation of one world by a CPU backend.
class WorldVisit {
 public:
  WorldVisit(CpuBackend& backend, WorldMemories& memories, std::size_t world)
      : backend_(backend), memory_(memories.of_world[world]) {
    backend_.begin_world(memory_, memories.trees);
  }
  ~WorldVisit() { backend_.end_world(memory_); }
  WorldVisit(const WorldVisit&) = delete;
  WorldVisit& operator=(const WorldVisit&) = delete;

 private:
  CpuBackend& backend_;
  WorldMemory& memory_;
};

class WorldsOnCpus final : public WorldByWorld {
 public:
  // `on_all_threads`: for worlds that are fewer than the threads.
  WorldsOnCpus(Resources& shared, CpuBackend& on_all_threads, WorldMemories& memories);

  void count(std::map<std::string, std::uint64_t>& stats) const override;

 private:
  // The resources of one thread, which computes a world at a time.
  struct Engine {
    Engine(Common& common, ThreadPool& one_thread) : resources(common, one_thread), backend(resources) {}
    Resources resources;
    CpuBackend backend;
    bool working = false;  // in this call
  };

  bool each_world(const Ask& ask) override;
  Engine& engine_of(int thread);
  void order(std::size_t side_by_side);
  void mark_stages();

  CpuBackend& on_all_threads_;
  WorldMemories& memories_;
  ThreadPool one_thread_{1};                      // of each engine: it runs jobs on the calling thread
  std::vector<std::unique_ptr<Engine>> engines_;  // by thread, created by its first world
  std::vector<std::size_t> order_;                // the worlds that get a thread each
};

}  // namespace hpccd
