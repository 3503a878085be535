// SPDX-License-Identifier: Apache-2.0
// Features of a snapshot that have different vertices at the same place. They touch, at distance 0. Meshes that were
// cut apart along a seam have many such pairs, which no error bound decides.
#pragma once

#include "base/vec3.h"

namespace hpccd {

// Whether any of the first n_first points equals any of the others. The coordinates are the given ones, not
// differences.
template <int n_first, int n>
HPCCD_HD bool share_a_place(const Vec3<double> (&q)[n]) {
  bool shared = false;
  for (int i = 0; i < n_first; ++i)
    for (int k = n_first; k < n; ++k) shared = shared || (q[i].x == q[k].x && q[i].y == q[k].y && q[i].z == q[k].z);
  return shared;
}

}  // namespace hpccd
