// SPDX-License-Identifier: Apache-2.0
// The joints of a robot, and the poses of its links.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "rigid/pose.h"

namespace hpccd::rigid {

enum class JointKind { fixed, turning, sliding };

// parent: number of the joint whose link it sits on; -1: the base. origin: its frame in that of the parent's link, at
// the value 0. axis: in its own frame, of length 1. offset: not below the length of the origin's shift.
struct Joint {
  JointKind kind;
  int parent;
  Pose origin;
  Vector axis;
  double offset;
};

// In the order of their tree. Never changes: threads may share it.
class JointChain {
 public:
  // Throws InvalidArgument: a parent does not come before its joint.
  explicit JointChain(std::vector<Joint> joints);

  const std::vector<Joint>& joints() const { return joints_; }
  std::size_t size() const { return joints_.size(); }

  // Of the link of each joint. values: radians, or the unit of coordinates; of each joint, what fixed ones have does
  // not matter. Throws InvalidArgument for another number of them.
  std::vector<Pose> poses(std::span<const double> values, const Pose& base) const;

 private:
  std::vector<Joint> joints_;
};

}  // namespace hpccd::rigid
