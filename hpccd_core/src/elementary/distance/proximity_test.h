// SPDX-License-Identifier: Apache-2.0
// Decides whether two features are within d of each other at one time, and computes their distance.
#pragma once

#include "elementary/distance/margins.h"
#include "elementary/distance/nearest.h"

namespace hpccd {

template <class R>
struct NearOrFar {
  using Mask = typename RealTraits<R>::Mask;
  Mask near, far;  // neither: undecided, or the distance is not accurate enough
  R distance;
};

// Relative to the size of the pair: the contract promises 1e-12 of the scene's, whose largest coordinate may be a sixth
// of it. Below this distance features may touch, which integers decide.
inline constexpr double distance_radius = 1.5e-13;

template <Kind kind, class R>
HPCCD_HD NearOrFar<R> proximity_test(const Snapshot<R>& at, R d) {
  const R s = max_norm(at.p) + max_norm(at.a) + max_norm(at.b);
  const Margins<R> margin = margins(d, s);
  const Nearest<R> found = nearest<kind>(at);
  const R length = square_root(found.square);
  R gaps[4];
  corner_gaps<kind>((R(1) / square_root(found.straight_square)) * found.straight, at, gaps);
  R least = gaps[0];
  for (int i = 1; i < n_corners<kind>; ++i) least = lesser(least, gaps[i]);
  const R radius = R(distance_radius) * s;
  const auto usable = squares_in_range(s) && length > R(2) * radius, known = length - least <= radius;
  return {usable && is_within(found.square, margin) && known, usable && least > margin.above, length};
}

}  // namespace hpccd
