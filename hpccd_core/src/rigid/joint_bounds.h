// SPDX-License-Identifier: Apache-2.0
// The motion of links while joints move at constant speed between values. hpccd_core/rigid/joints.py computes the
// bounds.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "rigid/joint_chain.h"

namespace hpccd::rigid {

// The geometry of a link that its bounds need: radius: at least the largest distance from the link's origin; centre,
// girth: a ball that contains it.
struct Ball {
  double radius, girth;
  Vector centre;
};

// acceleration: at least max |x''| of all its points during the step. span: from the origin of the first moving joint
// to the farthest point that the link may have. rounding: bound on the error of a computed point.
struct LinkBounds {
  double acceleration, span, rounding;
};

// The bounds of one step: data that its links share is computed once. Immutable: threads may share it.
class JointBounds {
 public:
  // Throws InvalidArgument unless start and end have one value for each joint.
  JointBounds(std::shared_ptr<const JointChain> chain, std::span<const double> start, std::span<const double> end,
              const Pose& base);

  // For the link of this joint. Throws InvalidArgument if there is no such joint.
  LinkBounds of_link(std::size_t link, const Ball& ball) const;

 private:
  struct Middle {
    Pose pose;
    Vector axis;
  };

  std::vector<std::size_t> way_to(std::size_t link) const;  // from the base
  double slid(std::size_t joint) const;

  std::shared_ptr<const JointChain> chain_;
  std::vector<double> start_, end_, speed_;
  std::vector<Middle> middle_;  // of each joint at mid-step
  double base_far_;
};

}  // namespace hpccd::rigid
