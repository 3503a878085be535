// SPDX-License-Identifier: Apache-2.0
// The elementary test as a floating-point filter: contact, no contact or undecided. The first two are proven by
// forward error bounds. Undecided queries go to the tier's fallback (exact arithmetic, a search, a tolerance).
#pragma once

#include "elementary/inside.h"
#include "elementary/roots.h"

namespace hpccd {

template <class R>
struct Outcome {
  using Mask = typename RealTraits<R>::Mask;
  Mask contact, none;  // neither: undecided
  R toc, delta;        // the true time of contact is within delta of toc
};

template <class Policy, class R>
HPCCD_HD CubicError<R> error_of(const Magnitudes<R>& size) {
  const CubicError<R> e = coplanarity_error(size);
  const R by(Policy::bound);
  return {by * e.coefficient, by * e.value, by * e.subdivided};
}

// The sign test on the coplanarity cubic only, for a separate pass (gpu/candidates.cuh).
template <class Policy, class R>
HPCCD_HD Outcome<R> coplanarity_filter(const Motion<R>& m) {
  const Magnitudes<R> size = magnitudes(m);
  const auto usable = in_range(size);
  return {R(1) < R(0), usable && certainly_no_root(coplanarity(m), error_of<Policy>(size).coefficient), R(0), R(0)};
}

// One part [low, high] of the step with exactly one root; f begins with the sign `sign`.
template <Kind kind, class Policy, class R>
HPCCD_HD Outcome<R> piece_with_one_root(const Motion<R>& m, const Magnitudes<R>& size, const Cubic<R>& f, R error,
                                        R low, R high, R sign, typename RealTraits<R>::Mask active) {
  const Root<R> root = bracketed_root(f, error, low, high, sign, active, Policy::time_step);
  const Verdict<R> v = inside<kind, Policy>(m, size, root.t, root.delta);
  const auto sure = active && (root.certain || R(0) < R(Policy::trust_roots ? 1 : 0));
  return {sure && v.yes && root.delta <= R(Policy::toc_radius), sure && v.no, root.t, root.delta};
}

// For f with certainly one root in [0, 1]: a quick test whether the features are certainly apart at that root. Two
// steps of Newton's method approach it, and most pairs that do not touch miss each other by far more than the remaining
// error. `delta` is a guess; the signs of f on both sides prove that the root is within it.
template <Kind kind, class R>
HPCCD_HD typename RealTraits<R>::Mask certainly_apart_at_root(const Motion<R>& m, const Magnitudes<R>& size,
                                                              const Cubic<R>& f, R error) {
  const R sign = select(f.c0 < R(0), R(-1), R(1));
  R t = f.c0 / (f.c0 - f.c3), step(0);
  for (int i = 0; i < 2; ++i) {
    const R next = lesser(greater(t - value(f, t) / slope(f, t), R(0)), R(1));
    step = magnitude(next - t);
    t = next;
  }
  R delta = greater(R(0.25) * step, R(1e-5));
  if constexpr (coordinate_error<R>() > 0) delta = greater(delta, R(2.1) * error / magnitude(slope(f, t)));
  const R left = t - delta, right = t + delta;
  const auto sure =
      (left <= R(0) || sign * value(f, left) > error) && (right >= R(1) || sign * value(f, right) < R(0) - error);
  return sure && inside<kind, Proven>(m, size, t, delta).no;  // proven bounds for all tiers, since `delta` is wide
}

// The common case: f certainly has one root in [0, 1].
template <Kind kind, class Policy, class R>
HPCCD_HD Outcome<R> single_root_test(const Motion<R>& m) {
  const Magnitudes<R> size = magnitudes(m);
  const Cubic<R> f = coplanarity(m);
  const R sign = select(f.c0 < R(0), R(-1), R(1));
  return piece_with_one_root<kind, Policy>(m, size, f, error_of<Policy>(size).value, R(0), R(1), sign, in_range(size));
}

// The general case: f is split at its extrema; each part has no root, one root, or is undecided.
template <Kind kind, class Policy, class R>
HPCCD_HD Outcome<R> many_roots_test(const Motion<R>& m) {
  using Mask = typename RealTraits<R>::Mask;
  const Magnitudes<R> size = magnitudes(m);
  const Cubic<R> f = coplanarity(m);
  const CubicError<R> error = error_of<Policy>(size);
  const TurningPoints<R> turn = turning_points(f);
  const Pieces<R> first = subdivide(f, turn.first);
  const Pieces<R> second = subdivide(first.right, (turn.second - turn.first) / (R(1) - turn.first));
  const Cubic<R> piece[3] = {first.left, second.left, second.right};
  const R bound[4] = {R(0), turn.first, turn.second, R(1)};
  Mask open = in_range(size);  // no contact found and nothing undecided in an earlier part
  Outcome<R> out{R(1) < R(0), R(1) < R(0), R(0), R(0)};
  for (int i = 0; i < 3; ++i) {
    const Mask one = open && certainly_one_root(piece[i], error.subdivided);
    const Mask empty = open && certainly_no_root(piece[i], error.subdivided);
    Mask passed = empty;
    if (any(one)) {
      const R sign = select(piece[i].c0 < R(0), R(-1), R(1));
      const Outcome<R> o =
          piece_with_one_root<kind, Policy>(m, size, f, error.value, bound[i], bound[i + 1], sign, one);
      out.contact = out.contact || o.contact;
      out.toc = select(o.contact, o.toc, out.toc);
      out.delta = select(o.contact, o.delta, out.delta);
      passed = passed || o.none;
    }
    open = passed;
  }
  out.none = open;
  return out;
}

}  // namespace hpccd
