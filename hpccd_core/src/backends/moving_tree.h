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

// How much memory the own trees of all worlds may take.
class TreeBudget {
 public:
  explicit TreeBudget(std::size_t n_worlds) : n_worlds_(n_worlds) {}
  // Trees of this size for all.
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
  bool built = false;  // the tree is whole
  std::uint64_t number = 0;
};

// Worlds have one topology, so that where there is no room for a tree each, a thread's worlds share one: refitting
// takes a twentieth of the time of building. Then a world whose pose has worn it out twice in a row gets a tree of its
// own. (64 worlds of cloth-drop, 2 threads: with a tree each 0.97 of two detectors, with one a thread 0.89.)
struct OwnTree {
  std::unique_ptr<KeptTree> kept;  // while that world is looked at: the common one
  std::size_t bytes = 0;           // of the budget
  bool wore_out_common = false;    // last time
};

class MovingTree {
 public:
  // All of them must outlive it.
  MovingTree(const Scene& scene, const Features& features, ThreadPool& pool)
      : scene_(scene), features_(features), pool_(pool) {
    motion_.features = &features;
  }

  // Bounds of a new motion. Throws InvalidArgument as MotionBounds::update does.
  void bound(Positions t0, Positions t1, std::span<const double> separations);
  // The same of one snapshot.
  void bound(Positions vertices, double distance = 0);
  // A tree that fits it: refitted, or built anew where refitting has lost too much. Marked as "refit" and "build".
  void fit(Profiler& profiler);
  void build_anew();
  // Boxes of the motion for these leaves alone.
  void fit_leaves(std::span<const std::uint32_t> leaves);
  // Boxes of the whole sweep, for methods with a hierarchy of their own.
  const std::vector<Box>& swept();

  // From here on the motions are those of one world among several, until end_world(). `always`: by a tree of its own.
  void begin_world(OwnTree& own, TreeBudget& budget, bool always);
  void end_world();

  // Whether there is a tree at all: a world's own is there from its first search on.
  bool built() const { return kept_.built; }
  const MotionBounds& motion() const { return motion_; }
  const Tree& tree() const { return kept_.tree; }
  // Another one for each tree of this process: the leaves are those of the last look where this is.
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
  bool followed_ = false;   // ... of the motion before, so that what rests can stay
  OwnTree* own_ = nullptr;  // of the world that is looked at
  TreeBudget* budget_ = nullptr;
  bool always_own_ = false;
};

}  // namespace hpccd
