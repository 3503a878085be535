// SPDX-License-Identifier: Apache-2.0
// The motion of a step and the default hierarchy over it, kept from step to step.
#pragma once

#include <atomic>
#include <memory>

#include "base/parallel.h"
#include "base/profiler.h"
#include "bvh/motion_bounds.h"
#include "bvh/tree.h"

namespace hpccd {

// The memory that the own trees of all worlds may use.
class TreeBudget {
 public:
  explicit TreeBudget(std::size_t n_worlds) : n_worlds_(n_worlds) {}
  // Whether trees of this size fit for all worlds.
  bool holds_all(std::size_t bytes) const { return bytes <= most / n_worlds_; }
  bool take(std::size_t bytes) {
    if (taken_.fetch_add(bytes, std::memory_order_relaxed) + bytes <= most) return true;
    give_back(bytes);
    return false;
  }
  void give_back(std::size_t bytes) { taken_.fetch_sub(bytes, std::memory_order_relaxed); }

 private:
  static constexpr std::size_t most = std::size_t{1} << 30;
  const std::size_t n_worlds_;
  std::atomic<std::size_t> taken_{0};
};

struct KeptTree {
  Tree tree;
  bool built = false;  // the tree is complete
  std::uint64_t number = 0;
};

// Worlds have one topology, so if there is not enough memory for a tree per world, the worlds of a thread share one:
// refitting takes a twentieth of the time of building. A world whose pose degrades the shared tree twice in a row gets
// its own. (64 worlds of cloth-drop, 2 threads: with a tree per world 0.97 of the throughput of two detectors, with one
// per thread 0.89.)
struct OwnTree {
  std::unique_ptr<KeptTree> kept;  // while that world is computed: the common tree
  std::size_t bytes = 0;           // of the budget
  bool wore_out_common = false;    // last time
};

class MovingTree {
 public:
  // The arguments must outlive the object. of_any_part: see MotionBounds.
  MovingTree(const Scene& scene, const Features& features, ThreadPool& pool, bool of_any_part = false)
      : scene_(scene), features_(features), pool_(pool) {
    motion_.features = &features, motion_.of_any_part = of_any_part;
  }

  // Bounds of a new motion. Throws InvalidArgument like MotionBounds::update.
  void bound(Positions t0, Positions t1, const Growth& growth);
  // The same for one snapshot.
  void bound(Positions vertices, double distance = 0);
  // Other ends of these vertices, within the bounds that they have.
  void shorten(Positions t0, Positions t1, std::span<const std::uint32_t> vertices) {
    motion_.shorten(t0, t1, vertices, pool_);
  }
  // Fits the tree: refits it, or rebuilds it if refitting has degraded it too much. Profiled as "refit" and "build".
  void fit(Profiler& profiler);
  void build_anew();
  // Boxes of the motion for these leaves only.
  void fit_leaves(std::span<const std::uint32_t> leaves);
  void find_least_edges() { hpccd::find_least_edges(kept_.tree); }
  // Boxes of the whole sweep, for methods with their own hierarchy.
  const std::vector<Box>& swept();

  // Until end_world() the motions are those of one world of several. `always`: with a tree of its own.
  void begin_world(OwnTree& own, TreeBudget& budget, bool always);
  void end_world();

  // Whether a tree exists: a world's own tree exists from its first search on.
  bool built() const { return kept_.built; }
  const MotionBounds& motion() const { return motion_; }
  const Tree& tree() const { return kept_.tree; }
  // Unique for each tree of this process: leaves with the same number are unchanged.
  std::uint64_t number() const { return kept_.number; }
  std::size_t bytes() const { return motion_.bytes() + kept_.tree.bytes(); }

 private:
  bool refitted(Profiler& profiler);
  void take_own();
  void give_up_own();

  const Scene& scene_;
  const Features& features_;
  ThreadPool& pool_;
  MotionBounds motion_;
  KeptTree kept_;
  bool fits_ = false;       // the tree's boxes are those of the last motion
  bool followed_ = false;   // ... of the previous motion, so that resting parts can be kept
  OwnTree* own_ = nullptr;  // of the world that is computed now
  TreeBudget* budget_ = nullptr;
  bool always_own_ = false;
};

}  // namespace hpccd
