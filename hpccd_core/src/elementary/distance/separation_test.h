// SPDX-License-Identifier: Apache-2.0
// The earliest time at which two features come within d > 0 of each other, found by certified steps. The test computes
// the direction of the gap at two times and interpolates it linearly between them. Along this direction the difference
// of two corners is quadratic in time, and its Bernstein coefficients bound it: if all of them are above d, the
// features are farther apart than d during the whole interval. Newton's method on the distance proposes the times. A
// hit is proven by two points of the features that are within d. Parallel edges and needles need no special case: the
// direction of a gap is always well defined.
#pragma once

#include "elementary/distance/margins.h"
#include "elementary/distance/nearest.h"
#include "elementary/filtered_test.h"

namespace hpccd {

// The features at one time.
template <Kind kind, class R>
struct Look {
  R t;
  Snapshot<R> at;
  Vec3<R> direction;                   // unit direction of the gap
  R length, slope;                     // lower bound on the gap, and its rate of change
  R square;                            // distance between two points of the features
  typename RealTraits<R>::Mask known;  // whether the direction is reliable
};

template <Kind kind, class R>
HPCCD_HD Look<kind, R> look(const Motion<R>& m, R s, R t) {
  const Snapshot<R> at = snapshot_at(m, t);
  const Nearest<R> near = nearest<kind>(at);
  const R length = square_root(near.straight_square);
  const Vec3<R> direction = (R(1) / length) * near.straight;
  const Vec3<R> velocity = (m.p1 - m.p0) - near.x * (m.a1 - m.a0) - near.y * (m.b1 - m.b0);
  return {t, at, direction, length, dot(direction, velocity), near.square, has_direction(near.straight_square, s)};
}

// Whether the features are certainly farther apart than d from one time to the other; limit: Margins::above.
template <Kind kind, class R>
HPCCD_HD typename RealTraits<R>::Mask free_between(const Look<kind, R>& i, const Look<kind, R>& j, R limit) {
  R begin[4], first[4], second[4], end[4];
  corner_gaps<kind>(i.direction, i.at, begin);
  corner_gaps<kind>(i.direction, j.at, first);
  corner_gaps<kind>(j.direction, i.at, second);
  corner_gaps<kind>(j.direction, j.at, end);
  auto all = i.known && j.known;
  for (int k = 0; k < n_corners<kind>; ++k)
    all = all && begin[k] > limit && R(0.5) * (first[k] + second[k]) > limit && end[k] > limit;
  return all;
}

template <Kind kind, class R>
HPCCD_HD Look<kind, R> select(typename RealTraits<R>::Mask m, const Look<kind, R>& a, const Look<kind, R>& b) {
  const auto vector = [&](const Vec3<R>& x, const Vec3<R>& y) {
    return Vec3<R>{select(m, x.x, y.x), select(m, x.y, y.y), select(m, x.z, y.z)};
  };
  return {select(m, a.t, b.t),
          {vector(a.at.p, b.at.p), vector(a.at.a, b.at.a), vector(a.at.b, b.at.b)},
          vector(a.direction, b.direction),
          select(m, a.length, b.length),
          select(m, a.slope, b.slope),
          select(m, a.square, b.square),
          (m && a.known) || (!m && b.known)};
}

// A contact is accepted if its time is known to this accuracy: the contract promises 1e-12.
inline constexpr double separation_toc_radius = 8e-13;

// With a gap of at most d between the features, p . n for n = a x b is at most d |n|. So where the cubic stays beyond d
// times the largest |n| of the step, the features stay apart; the largest |n| is bounded by its Bernstein coefficients,
// like the cubic. The rounding errors of n, 20 u |a||b| per coordinate, are at most as large as those of the cubic.
template <class R>
HPCCD_HD typename RealTraits<R>::Mask planes_stay_apart(const Motion<R>& m, R d) {
  const Magnitudes<R> size = magnitudes(m);
  const Vec3<R> n0 = cross(m.a0, m.b0), n2 = cross(m.a1, m.b1);
  const Vec3<R> n1 = R(0.5) * (cross(m.a0, m.b1) + cross(m.a1, m.b0));
  const R longest = square_root(greater(greater(dot(n0, n0), dot(n1, n1)), dot(n2, n2)));
  const R slack = d * (longest + R(64 * half_ulp<R>()) * (size.a * size.b)) * R(1 + 8 * half_ulp<R>());
  return in_range(size) && certainly_no_root(coplanarity(m), coplanarity_error(size).coefficient + slack);
}

// Whether two corners are certainly within d at the start. Where thicknesses are as large as features, as on coarse
// meshes with a bound, most contacts are found here, at a fifth of the cost of the nearest points.
template <Kind kind, class R>
HPCCD_HD typename RealTraits<R>::Mask corners_within(const Motion<R>& m, R d) {
  const R s = extent(magnitudes(m));
  const auto square = [](const Vec3<R>& v) { return dot(v, v); };
  const Vec3<R> other = m.p0 - m.a0;
  R least = lesser(square(m.p0), square(other));
  if constexpr (kind == Kind::vertex_face)
    least = lesser(least, square(m.p0 - m.b0));
  else
    least = lesser(least, lesser(square(m.p0 + m.b0), square(other + m.b0)));
  return squares_in_range(s) && is_within(least, margins(d, s));
}

// Decides by the states at the ends of the step: already within d, or kept apart by their directions.
template <Kind kind, class R>
HPCCD_HD Outcome<R> decided_by_ends(const Motion<R>& m, R d, const Look<kind, R>& start, const Look<kind, R>& end) {
  const R s = extent(magnitudes(m));
  const Margins<R> margin = margins(d, s);
  const auto usable = squares_in_range(s);
  return {usable && is_within(start.square, margin), usable && free_between(start, end, margin.above), R(0), R(0)};
}

template <Kind kind, class R>
HPCCD_HD Outcome<R> separation_filter(const Motion<R>& m, R d) {
  const R s = extent(magnitudes(m));
  return decided_by_ends(m, d, look<kind>(m, s, R(0)), look<kind>(m, s, R(1)));
}

// The time at which the gap would be `aim` long if it continued to change at its rate; the end of the step if it does
// not shrink.
template <Kind kind, class R>
HPCCD_HD R newton(const Look<kind, R>& at, R aim) {
  return select(at.slope < R(0), at.t + (at.length - aim) / (R(0) - at.slope), R(1));
}

// The state of the search for the earliest time, without the data of the pair: the search can be suspended after any
// step and resumed.
template <class R>
struct SearchState {
  R from;                  // certainly farther apart than d up to this time
  R high, length_at_high;  // certainly within d at this time, once it is found
  R reach;                 // step width at which trials have succeeded recently
  R guess;                 // from the last informative trial, on either side of the result
  R slow;                  // consecutive trials that were too late and not much earlier than the previous one
  R trial;                 // the next trial
};

// Passing a near miss by a relative 1e-15 takes 25 steps.
inline constexpr int most_search_steps = 60;

// For the time up to which the features of a motion are certainly farther apart than d.
template <Kind kind, class R>
class SeparationSearch {
 public:
  using Mask = typename RealTraits<R>::Mask;

  // Starts from a state before which they are.
  HPCCD_HD SeparationSearch(const Motion<R>& m, R d, const Look<kind, R>& start) : SeparationSearch(m, d) {
    from_ = start;
    const Mask usable = squares_in_range(s_);
    contact_ = usable && is_within(start.square, margin_);
    running_ = usable && !contact_;
    state_.high = R(2), state_.length_at_high = R(0), state_.reach = R(1), state_.slow = R(0);
    state_.guess = newton(start, aim_);
    state_.trial = lesser(greater(state_.guess, start.t + R(0.5) * radius()), R(1));
  }
  // Resumes a search from its state.
  HPCCD_HD SeparationSearch(const Motion<R>& m, R d, const SearchState<R>& left) : SeparationSearch(m, d) {
    state_ = left;
    from_ = look<kind>(m, s_, left.from);
    contact_ = R(1) < R(0);
    running_ = R(0) < R(1);
  }

  HPCCD_HD Mask running() const { return running_; }
  HPCCD_HD SearchState<R> state() const {
    SearchState<R> left = state_;
    left.from = from_.t;
    return left;
  }
  // Undecided while the search runs, and if it ended without a result; toc is then the latest time known to be free.
  HPCCD_HD Outcome<R> outcome() const { return {contact_, none_, from_.t, R(0)}; }

  HPCCD_HD void step(const Motion<R>& m) {
    const Look<kind, R> to = look<kind>(m, s_, state_.trial);
    const Mask within = running_ && is_within(to.square, margin_);
    const Mask free = running_ && !within && free_between(from_, to, margin_.above);
    const Mask blocked = !within && !free;
    const R ahead = state_.trial - from_.t, room_before = state_.high - from_.t;
    state_.reach = select(blocked, R(0.5) * ahead, R(3) * ahead);
    from_ = select(free, to, from_);
    state_.high = select(within, state_.trial, state_.high);
    state_.length_at_high = select(within, to.length, state_.length_at_high);
    state_.guess = select(blocked, state_.guess, newton(to, aim_));
    none_ = none_ || (free && state_.trial >= R(1));
    contact_ = contact_ || (running_ && state_.high - from_.t <= radius());
    // The two limits are farther apart than the features move in that time.
    const Mask hidden = free && from_.length < aim_ + margin_.above - margin_.below &&
                        (R(0) - from_.slope) * radius() < margin_.above - margin_.below;
    running_ = running_ && !none_ && !contact_ && !hidden && !(blocked && ahead <= R(0.25) * radius());

    const R room = state_.high - from_.t;
    state_.slow = select(within && room > R(0.5) * room_before, state_.slow + R(1), R(0));
    R next = state_.guess - from_.t;
    const Mask inside = next > R(0) && next < room;
    if (any(running_ && !inside)) {
      const R secant = room * ((from_.length - aim_) / (from_.length - state_.length_at_high));
      next = select(inside, next, secant);
    }
    next = select(state_.slow < R(5), next, R(0.5) * room);
    next = lesser(greater(next, R(0.5) * radius()), state_.reach);
    state_.trial = lesser(from_.t + next, R(1));
  }

 private:
  HPCCD_HD SeparationSearch(const Motion<R>& m, R d)
      : s_(extent(magnitudes(m))), margin_(margins(d, s_)), none_(R(1) < R(0)) {
    // Between these two distances rounding hides the result; trials aim as far before it.
    aim_ = margin_.above + (margin_.above - margin_.below);
  }
  HPCCD_HD static R radius() { return R(separation_toc_radius); }

  R s_, aim_;
  Margins<R> margin_;
  Look<kind, R> from_;
  Mask contact_, running_, none_;
  SearchState<R> state_;  // all except `from`, which is that of from_
};

// Starts from a time up to which the features are certainly farther apart than d. Undecided: toc is the latest such
// time.
template <Kind kind, class R>
HPCCD_HD Outcome<R> separation_test(const Motion<R>& m, R d, R start = R(0)) {
  SeparationSearch<kind, R> search(m, d, look<kind>(m, extent(magnitudes(m)), start));
  for (int i = 0; i < most_search_steps && any(search.running()); ++i) search.step(m);
  return search.outcome();
}

}  // namespace hpccd
