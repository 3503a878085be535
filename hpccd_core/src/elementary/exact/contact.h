// SPDX-License-Identifier: Apache-2.0
// The fallback of the exact tier: the earliest contact of one vertex-face or edge-edge query in integer arithmetic,
// and the side from which its features approach each other.
#pragma once

#include <optional>

#include "elementary/motion.h"

namespace hpccd::exact {

// q[0..3] as in motion.h, finite. Returns the exact time rounded down (error below 2^-60), or nothing.
std::optional<double> earliest_contact(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4]);

// How the features approach each other: the side of a x b (motion.h) on which p is just before the contact, and a x b
// at the contact, of any length. Zero if there is no side (the motion is coplanar throughout) or direction.
struct Approach {
  int side;
  Vec3<double> n;
};

// For a contact found at `toc`, which may have a rounding error.
Approach approach(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4], double toc);

}  // namespace hpccd::exact
