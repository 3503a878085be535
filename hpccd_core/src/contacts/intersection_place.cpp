// SPDX-License-Identifier: Apache-2.0
#include "contacts/intersection_place.h"

#include "contacts/meeting_point.h"
#include "elementary/intersection_filter.h"

namespace hpccd {
namespace {

// At least this far from the ends of the edge and the borders of the face doubles decide: more than their errors.
constexpr double certain = 0x1p-39;

}  // namespace

// In doubles where the edge certainly passes through the interior of the face. Bounds: by volume_test(), d has an error
// of e_d, height_p at most as much, and alpha and beta e_alpha and e_beta. A quotient in [0, 1] of numbers with errors
// e and e_d, and one rounding error, is within (e + e_d) / (|d| - e_d) + 2^-53 of the exact one. With e + e_d <= 2^-41
// |d| that is below 4.6e-13; the weight of the first corner has twice that and two rounding errors, less than 1e-12.
IntersectionPlace intersection_place(const Vec3<double> q[5]) {
  const EdgeFace<double> v = edge_face(q);
  const EdgeFaceSize<double> size(v);
  if (size.usable) {
    const Vec3<double> n = cross(v.a, v.b), m = cross(v.p, v.r);
    const double height_p = dot(v.p, n), d = dot(v.r, n) - height_p;
    const double ab = 64 * half_ulp<double>() * size.a * size.b, pr = 64 * half_ulp<double>() * size.p * size.r;
    const double e_d = ab * (size.p + size.r), error = e_d + greater(e_d, pr * greater(size.a, size.b));
    if (error <= 0x1p-41 * magnitude(d)) {
      const double s = -height_p / d, alpha = -dot(v.b, m) / d, beta = dot(v.a, m) / d, gamma = 1 - alpha - beta;
      if (lesser(lesser(s, 1 - s), lesser(lesser(alpha, beta), gamma)) > certain) return {s, {gamma, alpha, beta}, 0};
    }
  }
  return exact::place_of_intersection(q);
}

}  // namespace hpccd
