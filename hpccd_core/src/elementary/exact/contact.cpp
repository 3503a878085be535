// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/contact.h"

#include <algorithm>

#include "elementary/exact/root.h"

namespace hpccd::exact {
namespace {

template <class Z>
using Coordinates = std::array<Polynomial<Z>, 3>;  // a vector that moves: one polynomial a coordinate

template <class Z>
using Point = std::array<Z, 3>;

template <class Z>
Polynomial<Z> operator+(const Polynomial<Z>& a, const Polynomial<Z>& b) {
  return polynomial<Z>(a.c[0] + b.c[0], a.c[1] + b.c[1], a.c[2] + b.c[2], a.c[3] + b.c[3]);
}
template <class Z>
Polynomial<Z> operator-(const Polynomial<Z>& a, const Polynomial<Z>& b) {
  return polynomial<Z>(a.c[0] - b.c[0], a.c[1] - b.c[1], a.c[2] - b.c[2], a.c[3] - b.c[3]);
}
// Products of a linear polynomial with one of degree at most 2.
template <class Z>
Polynomial<Z> operator*(const Polynomial<Z>& a, const Polynomial<Z>& b) {
  return polynomial<Z>(a.c[0] * b.c[0], a.c[0] * b.c[1] + a.c[1] * b.c[0], a.c[0] * b.c[2] + a.c[1] * b.c[1],
                       a.c[1] * b.c[2]);
}

template <class Z>
Coordinates<Z> operator-(const Coordinates<Z>& a, const Coordinates<Z>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
template <class Z>
Coordinates<Z> operator+(const Coordinates<Z>& a, const Coordinates<Z>& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
template <class Z>
Coordinates<Z> cross(const Coordinates<Z>& a, const Coordinates<Z>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
template <class Z>
Polynomial<Z> dot(const Coordinates<Z>& a, const Coordinates<Z>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// All polynomials whose signs decide whether the features touch at a time at which f vanishes.
template <class Z>
struct Query {
  Kind kind;
  Coordinates<Z> p, a, b;     // as in motion.h
  Coordinates<Z> n, pb, ap;   // a x b, p x b, a x p
  Polynomial<Z> f;            // p . n

  Query(Kind k, const Coordinates<Z> q[4]) : kind(k) {
    if (k == Kind::vertex_face) {
      p = q[0] - q[1], a = q[2] - q[1], b = q[3] - q[1];
    } else {
      p = q[2] - q[0], a = q[1] - q[0], b = q[3] - q[2];
    }
    n = cross(a, b), pb = cross(p, b), ap = cross(a, p);
    f = dot(p, n);
  }

  // alpha n >= 0 and so on in coordinate k, each to be multiplied by the sign of n_k.
  std::vector<Polynomial<Z>> conditions(int k) const {
    if (kind == Kind::vertex_face) return {pb[k], ap[k], n[k] - pb[k] - ap[k]};
    return {pb[k], n[k] - pb[k], Polynomial<Z>{} - ap[k], n[k] + ap[k]};
  }

  // Where n vanishes the triangle is the union of its edges, and two segments are parallel or points: they touch where
  // a point lies on a segment. Each entry: the vectors from the segment's ends to the point.
  struct PointOnSegment {
    Coordinates<Z> from_start, from_end;
  };
  std::vector<PointOnSegment> degenerate() const {
    if (kind == Kind::vertex_face) return {{p, p - a}, {p, p - b}, {p - a, p - b}};
    const Coordinates<Z> a1_b0 = a - p;  // a1 - b0; b0 - a0 is p itself
    const Coordinates<Z> zero{};
    return {{zero - p, zero - p - b}, {a1_b0, a1_b0 - b}, {p, p - a}, {p + b, p + b - a}};
  }
};

// sign(q) tells the sign of a polynomial at the time in question, at which f vanishes.
template <class Z, class Sign>
bool touches(const Query<Z>& q, Sign&& sign_of) {
  for (int k = 0; k < 3; ++k) {
    const int s = sign_of(q.n[k]);
    if (s == 0) continue;
    for (const auto& c : q.conditions(k))
      if (sign_of(c) * s < 0) return false;
    return true;
  }
  for (const auto& d : q.degenerate()) {
    bool on_line = true;
    for (const auto& c : cross(d.from_start, d.from_end)) on_line = on_line && sign_of(c) == 0;
    // Between the ends, ends included; for a segment that is a point: at that point.
    if (on_line && sign_of(dot(d.from_start, d.from_end)) <= 0) return true;
  }
  return false;
}

template <class Z>
bool touches_at_start(const Query<Z>& q) {
  return sign(q.f.c[0]) == 0 && touches(q, [](const Polynomial<Z>& p) { return p.degree < 0 ? 0 : sign(p.c[0]); });
}

// Coplanar throughout: whether they touch can only change where one of these polynomials vanishes, and the set of
// times at which they do is closed, so the earliest is 0 or one of these roots.
template <class Z>
std::vector<IsolatedRoot<Z>> event_times(const Query<Z>& q) {
  std::vector<IsolatedRoot<Z>> events;
  const auto add = [&](const Polynomial<Z>& p) {
    if (p.degree < 1) return;
    for (auto& r : roots_in_unit(p)) events.push_back(std::move(r));
  };
  for (int k = 0; k < 3; ++k) {
    add(q.n[k]);
    for (const auto& c : q.conditions(k)) add(c);
  }
  for (const auto& d : q.degenerate()) add(dot(d.from_start, d.from_end));
  // Ordered to within 2^-60; closer events in the wrong order change the result by less than that.
  for (auto& e : events) e.refine_to(62);
  std::stable_sort(events.begin(), events.end(), [](const auto& x, const auto& y) { return x.lower() < y.lower(); });
  return events;
}

template <class Z>
bool bernstein_of_one_sign(const Polynomial<Z>& f) {
  const auto b = detail::to_bernstein(f);
  const int s = sign(b.b[0]);
  for (int i = 1; i <= b.n; ++i)
    if (sign(b.b[i]) != s) return false;
  return s != 0;
}

template <class Z>
std::optional<double> earliest(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4], int low) {
  Coordinates<Z> points[4];
  for (int i = 0; i < 4; ++i) {
    const double begin[3] = {q_t0[i].x, q_t0[i].y, q_t0[i].z}, end[3] = {q_t1[i].x, q_t1[i].y, q_t1[i].z};
    for (int k = 0; k < 3; ++k) {
      const Z z0 = scaled_integer<Z>(begin[k], low), z1 = scaled_integer<Z>(end[k], low);
      points[i][k] = polynomial<Z>(z0, z1 - z0);
    }
  }
  const Query<Z> q(kind, points);
  if (q.f.degree >= 0 && bernstein_of_one_sign(q.f)) return std::nullopt;
  if (touches_at_start(q)) return 0.0;
  for (auto& root : q.f.degree < 0 ? event_times(q) : roots_in_unit(q.f)) {
    if (touches(q, [&](const Polynomial<Z>& p) { return sign_at(p, root); })) {
      root.refine_to(62);
      return root.lower();
    }
  }
  return std::nullopt;
}

bool boxes_apart(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4]) {
  const int split = kind == Kind::vertex_face ? 1 : 2;
  const auto coordinate = [](const Vec3<double>& v, int k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; };
  for (int k = 0; k < 3; ++k) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < 4; ++i)
      for (const auto* q : {q_t0, q_t1}) {
        const double x = coordinate(q[i], k);
        low[i >= split] = std::min(low[i >= split], x);
        high[i >= split] = std::max(high[i >= split], x);
      }
    if (high[0] < low[1] || high[1] < low[0]) return true;
  }
  return false;
}

}  // namespace

std::optional<double> earliest_contact(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4]) {
  if (boxes_apart(kind, q_t0, q_t1)) return std::nullopt;
  BitRange range;
  for (int i = 0; i < 4; ++i)
    for (const auto* q : {q_t0, q_t1})
      for (double x : {q[i].x, q[i].y, q[i].z}) range.include(x);
  if (range.high < range.low) range = {0, 0};  // all coordinates are zero
  if (range.bits() <= fixed_coordinate_bits) return earliest<Fixed>(kind, q_t0, q_t1, range.low);
  return earliest<Big>(kind, q_t0, q_t1, range.low);
}

}  // namespace hpccd::exact
