// SPDX-License-Identifier: Apache-2.0
#include "rigid/joint_bounds.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "base/standard_arithmetic.h"
#include "hpccd/errors.h"
#include "rigid/c_library.h"
#include "rigid/pose.h"

namespace hpccd::rigid {

namespace {

// Bounds on rounding errors: those of hpccd_core/rigid/rounding.py, which derives them, bit-identical.

constexpr double unit = 0x1p-53;
constexpr double tiny = 1e-150;  // shorter lengths come from squares that underflow

// An upper bound on the exact result of a few operations on floats; 0 stays 0.
double up(double bound) { return bound * (1.0 + 0x1p-48); }

// An upper bound on the length; 0 for zeros.
double length(const Vector& v) { return any(v) ? up(std::sqrt(dot(v, v))) + tiny : 0.0; }

// values: sum over all joints of |q_0| + |q_1 - q_0|; reach: from the world's origin, base included.
double rounding_at_chain(double joints, double reach, double values) {
  return up(unit * reach * (128.0 * joints + 256.0 + 4.0 * values) + tiny);
}

// A moving joint between the base and a link. arm: from a point of its axis to the centre of the link.
struct Moving {
  bool turns;
  double speed;
  Vector axis, arm;
};

// The moving joints of a link, from the base on. slack: error of a length computed from the poses at mid-step.
struct Way {
  std::vector<Moving> moving;
  double girth, reach, slack;
};

double lesser(double a, double b) { return b < a ? b : a; }
double larger(double a, double b) { return b > a ? b : a; }

// G of each moving joint.
std::vector<double> distances(const Way& way) {
  std::vector<double> found(way.moving.size());
  double swept = 0;
  for (std::size_t k = found.size(); k-- > 0;) {
    const Moving& joint = way.moving[k];
    found[k] = joint.turns ? length(cross(joint.axis, joint.arm)) + way.girth + way.slack + swept : 1.0;
    swept += found[k] * std::abs(joint.speed) / 2;
  }
  return found;
}

// An upper bound on |x''| of any point of the link at t = 1/2.
double in_the_middle(const Way& way) {
  Vector of_centre{0, 0, 0}, turning{0, 0, 0}, of_turning{0, 0, 0};
  double total = 0, slides = 0;
  for (const Moving& joint : way.moving) {
    const Vector own = joint.speed * joint.axis;
    if (joint.turns) {
      const Vector column = cross(own, joint.arm);
      of_centre = of_centre + cross(2.0 * turning + own, column);
      of_turning = of_turning + cross(turning, own);
      turning = turning + own;
      total += std::abs(joint.speed);
    } else {
      of_centre = of_centre + cross(2.0 * turning, own);
      slides += std::abs(joint.speed);
    }
  }
  const double spin = length(of_turning) + squared(length(turning));
  // An axis has an error of slack relative to the reach; each product of two axes likewise, times the rotations.
  const double lost = way.slack * (total * total + 2 * total * slides / larger(way.reach, 1e-100));
  return up(length(of_centre) + spin * way.girth + lost);
}

// An upper bound on max |x''| of all points of the link during the step.
double acceleration(const Way& way) {
  if (std::ranges::none_of(way.moving, &Moving::turns)) return 0.0;
  const std::vector<double> distance = distances(way);
  double second = 0, third = 0, s = 0;  // s: of the previous rotations
  for (std::size_t k = 0; k < distance.size(); ++k) {
    const double d = std::abs(way.moving[k].speed), g = distance[k];
    if (way.moving[k].turns) {
      second += g * (d * (2 * s + d));
      third += g * (d * (3 * s * (s + d) + d * d));
      s += d;
    } else {
      second += g * (2 * s * d);
      third += g * (3 * s * s * d);
    }
  }
  return up(lesser(second, in_the_middle(way) + third / 2));
}

}  // namespace

JointBounds::JointBounds(std::shared_ptr<const JointChain> chain, std::span<const double> start,
                         std::span<const double> end, const Pose& base)
    : chain_(std::move(chain)), start_(start.begin(), start.end()), end_(end.begin(), end.end()) {
  const StandardArithmetic arithmetic;
  base_far_ = length(base.shift);
  const std::size_t n = chain_->size();
  if (start.size() != n || end.size() != n)
    throw InvalidArgument("start, end: expected " + std::to_string(n) + " values each, one for each joint");
  speed_.resize(n);
  std::vector<double> values(n);
  for (std::size_t k = 0; k < n; ++k) {
    speed_[k] = end_[k] - start_[k];
    values[k] = start_[k] + speed_[k] * 0.5;
  }
  const std::vector<Pose> poses = chain_->poses(values, base);
  middle_.reserve(n);
  for (std::size_t k = 0; k < n; ++k)
    middle_.push_back({poses[k], rotated(rotation_of(poses[k].turn), chain_->joints()[k].axis)});
}

LinkBounds JointBounds::of_link(std::size_t link, const Ball& ball) const {
  const StandardArithmetic arithmetic;
  if (link >= chain_->size())
    throw InvalidArgument("link: " + std::to_string(link) + "; there are " + std::to_string(chain_->size()) +
                          " joints");
  const std::vector<std::size_t> joints = way_to(link);
  const Vector centre = Placing(middle_[link].pose)(ball.centre);
  Way way{{}, ball.girth, 0, 0};
  way.moving.reserve(joints.size());
  double values = 0, offsets = 0, slid_first = 0, offsets_after = 0;
  for (std::size_t k : joints) {
    const Joint& joint = chain_->joints()[k];
    values += std::abs(start_[k]) + std::abs(speed_[k]);
    const double offset = joint.offset + slid(k);
    offsets += offset;
    const bool first = way.moving.empty();
    if (!first) offsets_after += offset;
    if (joint.kind == JointKind::fixed || speed_[k] == 0) continue;
    if (first) slid_first = slid(k);
    way.moving.push_back(
        {joint.kind == JointKind::turning, speed_[k], middle_[k].axis, centre - middle_[k].pose.shift});
  }
  way.reach = up(base_far_ + (ball.radius + offsets));
  const double rounding = rounding_at_chain(static_cast<double>(joints.size()), way.reach, values);
  way.slack = 8.0 * rounding;
  const double span = way.moving.empty() ? 0.0 : up(slid_first + (ball.radius + offsets_after));
  return {acceleration(way), span, rounding};
}

std::vector<std::size_t> JointBounds::way_to(std::size_t link) const {
  std::vector<std::size_t> joints;
  for (int k = static_cast<int>(link); k >= 0; k = chain_->joints()[static_cast<std::size_t>(k)].parent)
    joints.push_back(static_cast<std::size_t>(k));
  std::ranges::reverse(joints);
  return joints;
}

double JointBounds::slid(std::size_t joint) const {
  if (chain_->joints()[joint].kind != JointKind::sliding) return 0.0;
  return larger(std::abs(start_[joint]), std::abs(end_[joint]));
}

}  // namespace hpccd::rigid
