// SPDX-License-Identifier: Apache-2.0
#include "contacts/geometry.h"

#include <cmath>

#include "contacts/meeting_point.h"
#include "elementary/exact/contact.h"
#include "elementary/inside.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

struct Vertices {
  V t0[4], t1[4];
  V at(int i, double t) const { return interpolate(t0[i], t1[i], t); }
};

// The motion at the time of contact.
struct Moment {
  double t;
  V p, a, b, n;    // as in motion.h, and a x b
  double nn;       // |n|^2
  double product;  // |p||a||b|, the largest of the step in the maximum norm
  bool regular;    // doubles hold all products, and n is known well
};

Moment moment(const Motion<double>& m, double toc) {
  const Magnitudes<double> size{std::max(largest(m.p0), largest(m.p1)), std::max(largest(m.a0), largest(m.a1)),
                                std::max(largest(m.b0), largest(m.b1))};
  const V a = interpolate(m.a0, m.a1, toc), b = interpolate(m.b0, m.b1, toc), n = cross(a, b);
  // Below this sine of the angle between a and b, relative to their largest lengths in the step, the roundings of n
  // (20 u) are no longer small beside it.
  constexpr double flat = 1e-6;
  return {toc,
          interpolate(m.p0, m.p1, toc),
          a,
          b,
          n,
          dot(n, n),
          size.p * size.a * size.b,
          in_range(size) && largest(n) > flat * (size.a * size.b)};
}

// The side of n on which p is just before the contact; 0: not certain. With f = p . n and M = |p||a||b|, |f| <= 6 M,
// |f'| <= 36 M, |f''| <= 144 M; counting roundings as in coplanarity.h, f is known to 108 u M and f' to 600 u M.
int certain_side(const Motion<double>& m, const Moment& now) {
  const double f = dot(now.p, now.n), error = 1.5e-14 * now.product;
  const V da = m.a1 - m.a0, db = m.b1 - m.b0;
  const double slope = dot(m.p1 - m.p0, now.n) + dot(now.p, cross(da, now.b) + cross(now.a, db));
  // The root of f that belongs to the contact lies within the rounding of its time, or, in the tiers that promise no
  // time, about f / f' away. Up to twice as far (Kantorovich) f' shall keep its sign: then f comes from the other side.
  constexpr double time_error = 4e-12;
  const double steep = std::fabs(slope) - 1.2e-13 * now.product;
  if (!(steep > 0 && steep * steep > 150 * now.product * (time_error * steep + 2 * (std::fabs(f) + error)))) return 0;
  return slope < 0 ? 1 : -1;
}

V normal_of(Kind kind, const Vertices& q, const Motion<double>& m, const Moment& now) {
  if (const int side = now.regular ? certain_side(m, now) : 0) return (side / std::sqrt(now.nn)) * now.n;
  const exact::Approach a = exact::approach(kind, q.t0, q.t1, now.t);
  return a.side * unit(a.n);
}

// On the shorter edge: what is within rounding of it need not be within 1e-9 of its length on the longer one.
V crossing(const Vertices& q, const Moment& now) {
  const double size_a = largest(now.a), size_b = largest(now.b);
  const bool a_shorter = size_a < size_b;
  const auto on_shorter = [&](double place) {
    return a_shorter ? q.at(0, now.t) + place * now.a : q.at(2, now.t) + place * now.b;
  };
  if (now.regular) {
    const double per_nn = 1 / now.nn;
    const double on_a = std::clamp(per_nn * dot(cross(now.p, now.b), now.n), 0.0, 1.0),
                 on_b = std::clamp(per_nn * dot(cross(now.p, now.a), now.n), 0.0, 1.0);
    // What is left across both is no matter of the places.
    const V gap = now.p + on_b * now.b - on_a * now.a, along = gap - (per_nn * dot(gap, now.n)) * now.n;
    if (largest(along) <= 1e-10 * std::max(size_a, size_b)) return on_shorter(a_shorter ? on_a : on_b);
  }
  const Segment a{{0, 0, 0}, now.a}, b{now.p, now.b};
  return on_shorter(a_shorter ? meeting_place(b, a) : meeting_place(a, b));
}

template <Kind kind>
ContactPoint contact_point_of(const Vertices& q, double toc) {
  const Motion<double> m = motion_of<kind>(q.t0, q.t1);
  const Moment now = moment(m, toc);
  const V normal = normal_of(kind, q, m, now);
  const V point = kind == Kind::vertex_face ? q.at(0, toc) : crossing(q, now);
  return {{point.x, point.y, point.z}, {normal.x, normal.y, normal.z}};
}

}  // namespace

ContactPoint contact_point(const Geometry& g, Kind kind, std::uint32_t first, std::uint32_t second, double toc) {
  Vertices q;
  pair_positions(g, kind, first, second, q.t0, q.t1);
  return kind == Kind::vertex_face ? contact_point_of<Kind::vertex_face>(q, toc)
                                   : contact_point_of<Kind::edge_edge>(q, toc);
}

}  // namespace hpccd
