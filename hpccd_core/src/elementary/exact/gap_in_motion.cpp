// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/gap_in_motion.h"

#include "elementary/exact/given_motion.h"
#include "elementary/exact/nearest_place.h"
#include "elementary/exact/scaled.h"

namespace hpccd::exact {
namespace {

using V = Vec3<double>;

// The squares may overflow and underflow, the lengths do not.
struct Length {
  V unit;
  double length;

  explicit Length(const V& v, int exponent = 0) : unit{0, 0, 0}, length(0) {
    const double most = max_norm(v);
    if (!(most > 0)) return;
    unit = {v.x / most, v.y / most, v.z / most};
    const double rest = std::sqrt(dot(unit, unit));
    unit = (1 / rest) * unit;
    length = std::ldexp(most * rest, exponent);
  }
};

// Length and direction of x 2^exponent.
Length length_of(const Vector<Big>& x, int exponent) {
  double fraction[3];
  int e[3], most = std::numeric_limits<int>::min();
  for (int k = 0; k < 3; ++k) {
    fraction[k] = sign(x[k]) * magnitude_of(x[k], e[k]);
    if (fraction[k] != 0) most = std::max(most, e[k]);
  }
  for (int k = 0; k < 3; ++k)
    if (fraction[k] != 0) fraction[k] = std::ldexp(fraction[k], std::max(e[k] - most, -2000));
  return Length({fraction[0], fraction[1], fraction[2]}, std::clamp(most + exponent, -4000, 4000));
}

V vector_of(const Vector<Big>& x, int exponent) {
  const Length l = length_of(x, exponent);
  return l.length * l.unit;
}

// m / 2^k with m of any size.
struct BinaryTime {
  Big m = 0;
  int k = 0;

  void advance(double by) {
    const OddMantissa x(by);
    if (!x.mantissa) return;
    const int more = std::max(0, -x.exponent - k);
    m = (m << more) + (Big(x.mantissa) << (k + more + x.exponent));
    k += more;
  }
};

// The gap at one time, between the nearest parts of the features: point and face, two lines, point and line, or two
// points. While the nearest points stay inside these parts, the gap changes only by `velocity` and by the rotation of
// the parts. Times are fractions of the step.
struct Gap {
  double length;
  V direction;
  Length velocity;
  bool stands_on_normal = false;  // the gap is along the normal of a face or of two lines, and rotates with them
  double turning = 0;             // bound on the rotation of the parts, in radians
  double sliding = 0, room = 0;   // bound on the motion of the nearest points, relative to the parts and their borders
  double sum_of_steps = 0;        // sum of the lengths of the motions, of which the velocity is a difference
};

// Moving features, in units of 2^low.
class Moving {
 public:
  Moving(Kind kind, const V q_t0[4], const V q_t1[4]) : start_{kind, {}}, step_{kind, {}} {
    const Given begin(q_t0), end(q_t1);
    BitRange range = begin.range;
    range.include(end.range);
    low_ = range.low;
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < 3; ++k) {
        start_.q[i][k] = scaled_integer<Big>(begin.x[i][k], low_);
        step_.q[i][k] = scaled_integer<Big>(end.x[i][k], low_) - start_.q[i][k];
      }
  }

  Gap gap_at(const BinaryTime& t) const {
    Resting<Big> now{start_.kind, {}};
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < 3; ++k) now.q[i][k] = (start_.q[i][k] << t.k) + t.m * step_.q[i][k];
    Least<Big> least;
    now.for_nearest(least);
    const int unit = low_ - t.k;
    const double length = least.distance(unit);
    const Place& place = least.place;
    Gap gap = place.where == Place::inside       ? inside(now, place, unit)
              : place.where == Place::on_segment ? beside_line(now, place, unit)
                                                 : between_points(now, place, unit);
    gap.length = length;
    return gap;
  }

 private:
  Gap inside(const Resting<Big>& now, const Place& place, int unit) const {
    const auto [p, a, b] = now.spanned();
    const auto [dp, da, db] = step_.spanned();
    const Vector<Big> n = cross(a, b);
    const Length a_ = length_of(a, unit), b_ = length_of(b, unit), n_ = length_of(n, 0);
    const double sine = max_norm(cross(a_.unit, b_.unit)) > 1e-8
                            ? Length(cross(a_.unit, b_.unit)).length
                            : ratio(dot(n, n), dot(a, a) * dot(b, b));  // its square: small enough in either case
    const Length da_ = length_of(da, low_), db_ = length_of(db, low_);
    const V drift = vector_of(dp, low_) - place.alpha * (da_.length * da_.unit) - place.beta * (db_.length * db_.unit);
    Gap gap{0, static_cast<double>(sign(dot(p, n))) * n_.unit, Length({0, 0, 0})};
    gap.velocity = Length(dot(drift, gap.direction) * gap.direction);
    gap.stands_on_normal = true;
    gap.turning = (da_.length / a_.length + db_.length / b_.length) / sine;
    gap.sliding = Length(drift).length / (std::min(a_.length, b_.length) * sine);
    gap.room = start_.kind == Kind::vertex_face ? std::min({place.alpha, place.beta, 1 - place.alpha - place.beta})
                                                : std::min({place.alpha, 1 - place.alpha, -place.beta, 1 + place.beta});
    gap.sum_of_steps = Length(vector_of(dp, low_)).length + da_.length + db_.length;
    return gap;
  }
  // From edge a to edge b, or from the face to the vertex.
  double orientation(int point) const { return start_.kind == Kind::edge_edge && point < 2 ? -1 : 1; }

  Gap beside_line(const Resting<Big>& now, const Place& place, int unit) const {
    const auto [point, from, to] = point_segments[start_.kind == Kind::edge_edge][place.segment];
    const Vector<Big> w = now.q[point] - now.q[from], e = now.q[to] - now.q[from];
    const Vector<Big> dw = step_.q[point] - step_.q[from], de = step_.q[to] - step_.q[from];
    const Big along = dot(w, e), square = dot(e, e);
    Vector<Big> across;
    for (int k = 0; k < 3; ++k) across[k] = w[k] * square - e[k] * along;
    const Length e_ = length_of(e, unit), de_ = length_of(de, low_), dw_ = length_of(dw, low_);
    const V drift = dw_.length * dw_.unit - (place.along * de_.length) * de_.unit;
    const double sign = orientation(point);
    Gap gap{0, sign * length_of(across, 0).unit, Length(sign * (drift - dot(drift, e_.unit) * e_.unit))};
    gap.turning = de_.length / e_.length;
    gap.sum_of_steps = dw_.length + de_.length;
    return gap;
  }
  Gap between_points(const Resting<Big>& now, const Place& place, int unit) const {
    const auto [point, from, to] = point_segments[start_.kind == Kind::edge_edge][place.segment];
    const int other = place.along > 0 ? to : from;
    const double sign = orientation(point);
    const Length velocity = length_of(step_.q[point] - step_.q[other], low_);
    Gap gap{0, sign * length_of(now.q[point] - now.q[other], unit).unit, velocity};
    gap.velocity.unit = sign * velocity.unit;
    gap.sum_of_steps = velocity.length;
    return gap;
  }

  Resting<Big> start_, step_;
  int low_;
};

// The time until the gap has shrunk to d, or until it is shortest, if its velocity were constant. At most a whole step.
double time_until(const Gap& gap, double d) {
  const V& g = gap.direction;
  const V& v = gap.velocity.unit;
  const V moment = cross(g, v);
  const double shorter = d / gap.length, room = shorter * shorter - dot(moment, moment);
  const double ahead = 0 - dot(g, v) - (room > 0 ? std::sqrt(room) : 0);
  return ahead > 0 ? std::min(ahead * gap.length / gap.velocity.length, 1.0) : 0;
}

}  // namespace

Vec3<double> direction_of_gap(Kind kind, const V q_t0[4], const V q_t1[4], double toc, double d) {
  const Moving motion(kind, q_t0, q_t1);
  BinaryTime t;
  t.advance(toc);
  V direction{0, 0, 0};
  // Each iteration gains 40 bits of the gap: enough for all exponents of doubles, and more for curved paths.
  constexpr int most_turns = 60;
  for (int i = 0; i < most_turns; ++i) {
    const Gap gap = motion.gap_at(t);
    if (!(gap.length > 0)) break;
    direction = gap.direction;
    if (!(gap.length > d) || !(gap.velocity.length > 0)) break;
    const double rest = time_until(gap, d), turning = rest * gap.turning;
    // The remaining motion changes the direction by at most this: by the rotation of the parts if the gap is along a
    // normal; otherwise by the motion of its ends relative to its length.
    constexpr double enough = 1e-9;
    const bool stays = gap.stands_on_normal && 2 * rest * gap.sliding < gap.room;
    if (turning < enough && (stays || gap.sum_of_steps * rest < enough * gap.length)) break;
    // Never beyond the time: after it the gap may open to the other side.
    const double error = 0x1p-40 + 2 * turning + 0x1p-48 * gap.sum_of_steps / gap.velocity.length;
    t.advance(rest * (error < 0.5 ? 1 - error : 0.5));
  }
  return direction;
}

bool stay_parallel(const V q_t0[4], const V q_t1[4]) {
  // Rounding errors of the edges' directions and of their product are below 16 units in its last place.
  for (const V* q : {q_t0, q_t1})
    if (max_norm(cross(Length(q[1] - q[0]).unit, Length(q[3] - q[2]).unit)) > 1e-14) return false;
  const auto never_spanned = [](const auto& query) {
    return query.n[0].degree() < 0 && query.n[1].degree() < 0 && query.n[2].degree() < 0;
  };
  const GivenMotion given(q_t0, q_t1);
  if (given.bits <= Widths<Integer<1>>::coordinate_bits) return never_spanned(given.query<Integer<1>>(Kind::edge_edge));
  if (given.bits <= Widths<Integer<2>>::coordinate_bits) return never_spanned(given.query<Integer<2>>(Kind::edge_edge));
  return never_spanned(given.query<Big>(Kind::edge_edge));
}

}  // namespace hpccd::exact
