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

// Worlds share a tree as long as it serves them: their topology is the same, and refitting takes a twentieth of the
// time of building. A world whose pose it does not fit gets a tree of its own.
class OwnTrees {
 public:
  bool room_for(std::size_t bytes) const { return bytes_.load(std::memory_order_relaxed) + bytes <= most_bytes; }
  void add(std::size_t bytes) { bytes_.fetch_add(bytes, std::memory_order_relaxed); }

 private:
  static constexpr std::size_t most_bytes = std::size_t{1} << 30;
  std::atomic<std::size_t> bytes_{0};
};

class MovingTree {
 public:
  struct Kept {
    Tree tree;
    bool built = false;  // the tree is whole
    std::uint64_t number = 0;
  };

  // All of them must outlive it.
  MovingTree(const Scene& scene, const Features& features, ThreadPool& pool)
      : scene_(scene), features_(features), pool_(pool) {}

  // Bounds of a new motion. Throws InvalidArgument as MotionBounds::update does.
  void bound(Positions t0, Positions t1, std::span<const double> separations);
  // The same of one snapshot.
  void bound(Positions vertices);
  // A tree that fits it: refitted, or built anew where refitting has lost too much. Marked as "refit" and "build".
  void fit(Profiler& profiler);
  void build_anew();
  // Boxes of the motion for these leaves alone.
  void fit_leaves(std::span<const std::uint32_t> leaves);
  // Boxes of the whole sweep, for methods with a hierarchy of their own.
  const std::vector<Box>& swept();

  // Of several worlds, at the beginning of a call: the tree that they share may be built anew, once.
  void begin_worlds() { common_is_new_ = false; }
  // From here on the motions are those of one world, whose own tree is used, if it has one. `always`: it gets one.
  void begin_world(std::unique_ptr<Kept>& own, OwnTrees& all, bool always);
  void end_world();

  const MotionBounds& motion() const { return motion_; }
  const Tree& tree() const { return kept_.tree; }
  // Another one for each tree of this process: the leaves are those of the last look where this is.
  std::uint64_t number() const { return kept_.number; }
  std::size_t bytes() const { return motion_.bytes() + kept_.tree.bytes(); }

 private:
  void set_common_aside();

  const Scene& scene_;
  const Features& features_;
  ThreadPool& pool_;
  MotionBounds motion_;
  Kept kept_;
  bool fits_ = false;      // the tree's boxes are those of the last motion
  bool followed_ = false;  // ... of the motion before, so that what rests can stay
  // Of several worlds: where the own tree of this one is kept, and meanwhile the common one.
  std::unique_ptr<Kept>* own_ = nullptr;
  OwnTrees* own_trees_ = nullptr;
  bool common_is_new_ = false;
};

}  // namespace hpccd
