// SPDX-License-Identifier: Apache-2.0
// Arbiters decide where doubles cannot determine a point or a direction: integers of any size on CPUs, integers of a
// fixed size on devices, or none (the row stays undecided).
#pragma once

#include "elementary/exact/contact.h"
#include "elementary/exact/distance.h"
#include "elementary/exact/fixed_approach.h"
#include "elementary/exact/gap_in_motion.h"

namespace hpccd {

struct ByIntegers {
  // q_t0, q_t1: the vertices at the given time.
  exact::Nearest nearest(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4],
                         const Vec3<double> q[4]) const {
    return exact::nearest(kind, q, kind == Kind::edge_edge && exact::stay_parallel(q_t0, q_t1));
  }
  Vec3<double> direction_of_gap(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4], double toc,
                                double separation) const {
    return exact::direction_of_gap(kind, q_t0, q_t1, toc, separation);
  }
  exact::Approach approach(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4], double toc) const {
    return exact::approach(kind, q_t0, q_t1, toc);
  }
};

// Leaves the row open. Once a row is open, all other results for it, here and below, are meaningless.
struct LeftOpen {
  bool open = false;

  HPCCD_HD exact::Nearest nearest(Kind, const Vec3<double>*, const Vec3<double>*, const Vec3<double>*) {
    open = true;
    return {};
  }
  HPCCD_HD Vec3<double> direction_of_gap(Kind, const Vec3<double>*, const Vec3<double>*, double, double) {
    open = true;
    return {0, 0, 0};
  }
  HPCCD_HD exact::Approach approach(Kind, const Vec3<double>*, const Vec3<double>*, double) {
    open = true;
    return {};
  }
};

// Like exact::approach, but without integers of any size.
struct ByFixedIntegers {
  bool open = false;

  HPCCD_HD exact::Nearest nearest(Kind, const Vec3<double>*, const Vec3<double>*, const Vec3<double>*) {
    open = true;
    return {};
  }
  HPCCD_HD Vec3<double> direction_of_gap(Kind, const Vec3<double>*, const Vec3<double>*, double, double) {
    open = true;
    return {0, 0, 0};
  }
  HPCCD_HOST_DEVICE exact::Approach approach(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4],
                                             double toc) {
    const std::optional<exact::Approach> answer = exact::fixed_approach(kind, exact::GivenMotion(q_t0, q_t1), toc);
    open = open || !answer;
    return answer.value_or(exact::Approach{});
  }
};

}  // namespace hpccd
