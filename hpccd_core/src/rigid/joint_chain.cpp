// SPDX-License-Identifier: Apache-2.0
#include "rigid/joint_chain.h"

#include <string>
#include <utility>

#include "base/standard_arithmetic.h"
#include "hpccd/errors.h"
#include "rigid/c_library.h"

namespace hpccd::rigid {
namespace {

// The pose of the joint's frame at `value`, in its frame at 0.
Pose moved(const Joint& joint, double value) {
  switch (joint.kind) {
    case JointKind::turning: {
      const Vector turned = sine(value / 2) * joint.axis;
      return {{turned.x, turned.y, turned.z, cosine(value / 2)}, {0, 0, 0}};
    }
    case JointKind::sliding:
      return {{}, value * joint.axis};
    case JointKind::fixed:
      break;
  }
  return {};
}

}  // namespace

JointChain::JointChain(std::vector<Joint> joints) : joints_(std::move(joints)) {
  for (std::size_t k = 0; k < joints_.size(); ++k)
    if (const int parent = joints_[k].parent; parent < -1 || parent >= static_cast<int>(k))
      throw InvalidArgument("parents: that of joint " + std::to_string(k) + " is " + std::to_string(parent) +
                            "; it must come before it, or be -1");
}

std::vector<Pose> JointChain::poses(std::span<const double> values, const Pose& base) const {
  const StandardArithmetic arithmetic;
  if (values.size() != joints_.size())
    throw InvalidArgument("values: expected " + std::to_string(joints_.size()) + ", one for each joint, got " +
                          std::to_string(values.size()));
  std::vector<Pose> found;
  found.reserve(joints_.size());
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const Joint& joint = joints_[k];
    const Pose& before = joint.parent < 0 ? base : found[static_cast<std::size_t>(joint.parent)];
    found.push_back(after(after(before, joint.origin), moved(joint, values[k])));
  }
  return found;
}

}  // namespace hpccd::rigid
