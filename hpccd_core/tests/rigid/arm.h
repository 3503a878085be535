// SPDX-License-Identifier: Apache-2.0
// Planar arms: all joints turn about z or slide along x, each at 1 from the one before.
#pragma once

#include <memory>
#include <vector>

#include "rigid/joint_chain.h"

namespace hpccd::test {

inline std::vector<rigid::Joint> arm_joints(const std::vector<rigid::JointKind>& kinds) {
  std::vector<rigid::Joint> joints;
  for (const rigid::JointKind kind : kinds) {
    const double offset = joints.empty() ? 0 : 1;
    const rigid::Vector axis = kind == rigid::JointKind::sliding ? rigid::Vector{1, 0, 0} : rigid::Vector{0, 0, 1};
    joints.push_back({kind, static_cast<int>(joints.size()) - 1, {{}, {offset, 0, 0}}, axis, offset});
  }
  return joints;
}

inline std::shared_ptr<const rigid::JointChain> arm(const std::vector<rigid::JointKind>& kinds) {
  return std::make_shared<const rigid::JointChain>(arm_joints(kinds));
}

}  // namespace hpccd::test
