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

// What of a link's geometry its bounds need: radius: not below the farthest from the link's origin; centre, girth: a
// ball that holds it.
struct Ball {
  double radius, girth;
  Vector centre;
};

// acceleration: not below max |x''| of all its points through the step. span: from the origin of the first joint that
// moves to the farthest point that the link may have. rounding: how far a computed point may be from where it should
// be.
struct LinkBounds {
  double acceleration, span, rounding;
};

// Of one step: what its links share is computed once. Never changes: threads may share it.
class JointBounds {
 public:
  // Throws InvalidArgument where start or end is not of one value for each joint.
  JointBounds(std::shared_ptr<const JointChain> chain, std::span<const double> start, std::span<const double> end,
              const Pose& base);

  // Of the link of this joint. Throws InvalidArgument where there is no such joint.
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
  std::vector<Middle> middle_;  // of each joint in the middle of the step
  double base_far_;
};

}  // namespace hpccd::rigid
