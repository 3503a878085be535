// SPDX-License-Identifier: Apache-2.0
// The joints of a robot, and the poses of its links.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "rigid/pose.h"

namespace hpccd::rigid {

enum class JointKind { fixed, turning, sliding };

// parent: number of the joint of the link to which it is attached; -1: the base. origin: its frame in that of the
// parent's link, at the value 0. axis: in its own frame, of length 1. offset: at least the length of the origin's
// translation.
struct Joint {
  JointKind kind;
  int parent;
  Pose origin;
  Vector axis;
  double offset;
};

// Joints in the order of their tree. Immutable: threads may share it.
class JointChain {
 public:
  // Throws InvalidArgument if a parent does not come before its joint.
  explicit JointChain(std::vector<Joint> joints);

  const std::vector<Joint>& joints() const { return joints_; }
  std::size_t size() const { return joints_.size(); }

  // The pose of each joint's link. values: radians, or the unit of coordinates, for each joint; those of fixed joints
  // are ignored. Throws InvalidArgument for another number of values.
  std::vector<Pose> poses(std::span<const double> values, const Pose& base) const;

 private:
  std::vector<Joint> joints_;
};

}  // namespace hpccd::rigid
