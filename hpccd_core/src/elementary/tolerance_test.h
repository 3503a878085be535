// SPDX-License-Identifier: Apache-2.0
// The fallback of the "balanced" tier: pairs that the error bounds leave undecided are decided in double precision
// with a relative tolerance. Borders count as inside. Motion that is coplanar throughout has a branch of its own.
#pragma once

#include "elementary/inside.h"
#include "elementary/kdop_filter.h"
#include "elementary/roots.h"

namespace hpccd::tolerance_test {

// Relative to the size of the compared quantity. Undecided queries are within about 1e-12 of a border.
inline constexpr double tolerance = 1e-11;

struct Answer {
  bool contact;
  double toc;
};

HPCCD_HD bool point_on_segment(Vec3<double> from_start, Vec3<double> from_end) {
  const Vec3<double> c = cross(from_start, from_end), along = from_start - from_end;
  const double length2 = dot(along, along), scale = dot(from_start, from_start) + dot(from_end, from_end);
  if (length2 <= tolerance * tolerance) return scale <= 4 * tolerance * tolerance;
  // |c| is the distance from the line times the length.
  return dot(c, c) <= tolerance * tolerance * length2 && dot(from_start, from_end) <= tolerance * length2;
}

template <Kind kind>
HPCCD_HD bool touches_at(const Motion<double>& m, double t) {
  const Vec3<double> p = interpolate(m.p0, m.p1, t), a = interpolate(m.a0, m.a1, t), b = interpolate(m.b0, m.b1, t);
  const Vec3<double> n = cross(a, b);
  const double aa = dot(a, a), bb = dot(b, b), d = dot(n, n);
  if (d > 1e-18 * aa * bb) {
    const double alpha = dot(cross(p, b), n), beta = dot(cross(a, p), n), e = tolerance * d;
    if constexpr (kind == Kind::vertex_face) return alpha >= -e && beta >= -e && d - alpha - beta >= -e;
    return alpha >= -e && d - alpha >= -e && -beta >= -e && d + beta >= -e;
  }
  if constexpr (kind == Kind::vertex_face)
    return point_on_segment(p, p - a) || point_on_segment(p, p - b) || point_on_segment(p - a, p - b);
  const Vec3<double> zero{0, 0, 0};
  return point_on_segment(zero - p, zero - p - b) || point_on_segment(a - p, a - p - b) || point_on_segment(p, p - a) ||
         point_on_segment(p + b, p + b - a);
}

// Candidate times in ascending order. There are at most 34: two roots of each coordinate of four cross products and of
// four dot products (add_border_events), and both ends.
struct Times {
  static constexpr int capacity = 34;
  double t[capacity];
  int n = 0;
  HPCCD_HD void add(double x) {
    if (!(x >= 0 && x <= 1) || n == capacity) return;
    int i = n++;
    for (; i > 0 && t[i - 1] > x; --i) t[i] = t[i - 1];
    t[i] = x;
  }
};

// Roots in [0, 1] of q0 (1-t)^2 + q1 (1-t) t + q2 t^2.
HPCCD_HD void add_quadratic_roots(Times& times, double q0, double q1, double q2) {
  const double a = q0 - q1 + q2, b = 0.5 * q1 - q0;
  const double discriminant = b * b - a * q0;
  const double root = square_root(greater(discriminant, 0.0));
  const double q = -(b < 0 ? b - root : b + root);
  if (a != 0) times.add(q / a);
  if (q != 0) times.add(q0 / q);
}

// For motion that is coplanar throughout: the times at which a coordinate of one of the border conditions vanishes.
template <Kind kind>
HPCCD_HD void add_border_events(Times& times, const Motion<double>& m) {
  const auto add = [&](double ux0, double uy0, double ux1, double uy1, double vx0, double vy0, double vx1, double vy1) {
    const Quadratic<double> q = planar_cross(ux0, uy0, ux1, uy1, vx0, vy0, vx1, vy1);
    add_quadratic_roots(times, q.q0, q.q1, q.q2);
  };
  const auto add_cross = [&](Vec3<double> u0, Vec3<double> u1, Vec3<double> v0, Vec3<double> v1) {
    add(u0.y, u0.z, u1.y, u1.z, v0.y, v0.z, v1.y, v1.z);
    add(u0.z, u0.x, u1.z, u1.x, v0.z, v0.x, v1.z, v1.x);
    add(u0.x, u0.y, u1.x, u1.y, v0.x, v0.y, v1.x, v1.y);
  };
  const auto add_dot = [&](Vec3<double> u0, Vec3<double> u1, Vec3<double> v0, Vec3<double> v1) {
    add_quadratic_roots(times, dot(u0, v0), dot(u0, v1) + dot(u1, v0), dot(u1, v1));
  };
  add_cross(m.p0, m.p1, m.b0, m.b1);
  add_cross(m.a0, m.a1, m.p0, m.p1);
  if constexpr (kind == Kind::vertex_face) {
    add_cross(m.p0 - m.a0, m.p1 - m.a1, m.b0 - m.a0, m.b1 - m.a1);
    add_dot(m.p0, m.p1, m.p0 - m.a0, m.p1 - m.a1);
    add_dot(m.p0, m.p1, m.p0 - m.b0, m.p1 - m.b1);
    add_dot(m.p0 - m.a0, m.p1 - m.a1, m.p0 - m.b0, m.p1 - m.b1);
  } else {
    const Vec3<double> q0 = m.a0 - m.p0, q1 = m.a1 - m.p1, r0 = m.p0 + m.b0, r1 = m.p1 + m.b1;
    add_cross(q0, q1, m.b0, m.b1);
    add_cross(m.a0, m.a1, r0, r1);
    add_dot(m.p0, m.p1, m.p0 - m.a0, m.p1 - m.a1);
    add_dot(r0, r1, r0 - m.a0, r1 - m.a1);
    add_dot(m.p0, m.p1, r0, r1);
    add_dot(q0, q1, q0 - m.b0, q1 - m.b1);
  }
}

// Scales by one power of two so that the largest coordinate is about one: no overflow, and underflow is below
// tolerance.
HPCCD_HD Motion<double> normalised(Motion<double> m) {
  const Magnitudes<double> size = magnitudes(m);
  const double largest = greater(greater(size.p, size.a), size.b);
  if (!(largest > 0)) return m;
  const int e = ilogb(largest);
  Vec3<double>* vectors[6] = {&m.p0, &m.a0, &m.b0, &m.p1, &m.a1, &m.b1};
  for (auto* v : vectors) *v = {scalbn(v->x, -e), scalbn(v->y, -e), scalbn(v->z, -e)};
  return m;
}

template <Kind kind>
HPCCD_HD Answer decide(const Motion<double>& given) {
  const Motion<double> m = normalised(given);
  const Magnitudes<double> size = magnitudes(m);
  const Cubic<double> f = coplanarity(m);
  const double error = 4 * coplanarity_error(size).value;
  const auto vanishes = [&](double x) { return magnitude(x) <= error; };
  Times times;
  if (vanishes(f.c0) && vanishes(f.c3) && magnitude(f.k1) <= 3 * error && magnitude(f.k2) <= 3 * error) {
    times.add(0);
    add_border_events<kind>(times, m);
    times.add(1);
  } else {
    if (vanishes(f.c0)) times.add(0);
    const TurningPoints<double> turn = turning_points(f);
    const double bound[4] = {0, turn.first, turn.second, 1};
    for (int i = 0; i < 3; ++i) {
      const double begin = value(f, bound[i]), end = value(f, bound[i + 1]);
      if ((begin > 0) != (end > 0) && bound[i] < bound[i + 1])
        times.add(bracketed_root(f, error, bound[i], bound[i + 1], begin > 0 ? 1.0 : -1.0, true).t);
      if (i < 2 && vanishes(end)) times.add(bound[i + 1]);  // touches zero without crossing
    }
    if (vanishes(f.c3)) times.add(1);
  }
  for (int i = 0; i < times.n; ++i)
    if (touches_at<kind>(m, times.t[i])) return {true, times.t[i]};
  return {false, 0};
}

// The same for features given by their vertices.
template <Kind kind>
HPCCD_HD Answer contact(const Vec3<double> t0[4], const Vec3<double> t1[4]) {
  if (apart<kind>(t0, t1)) return {false, 0};
  return decide<kind>(motion_of<kind>(t0, t1));
}

}  // namespace hpccd::tolerance_test
