// SPDX-License-Identifier: Apache-2.0
// The motion of a step and the default hierarchy over it, kept from step to step.
#pragma once

#include "base/parallel.h"
#include "base/profiler.h"
#include "bvh/motion_bounds.h"
#include "bvh/tree.h"

namespace hpccd {

class MovingTree {
 public:
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

  const MotionBounds& motion() const { return motion_; }
  const Tree& tree() const { return tree_; }
  // How many trees there have been: the leaves are those of the last look where this is.
  std::uint64_t builds() const { return builds_; }
  std::size_t bytes() const { return motion_.bytes() + tree_.bytes(); }

 private:
  const Scene& scene_;
  const Features& features_;
  ThreadPool& pool_;
  MotionBounds motion_;
  Tree tree_;
  bool built_ = false;     // the tree is whole
  bool fits_ = false;      // the tree's boxes are those of the last motion
  bool followed_ = false;  // ... of the motion before, so that what rests can stay
  std::uint64_t builds_ = 0;
};

}  // namespace hpccd
