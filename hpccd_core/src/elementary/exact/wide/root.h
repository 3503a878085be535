// SPDX-License-Identifier: Apache-2.0
// A real root in [0, 1] of an integer polynomial, to any precision. Coordinates may differ by 1500 binary orders of
// magnitude and roots by thousands of bits, so no step gains a fixed number of bits: the exponent of the distance to
// the neighbouring roots is found first, then every step doubles the known bits. Since such roots form clusters,
// computations use the offset from a nearby base, which has few bits where the root has thousands.
#pragma once

#include <vector>

#include "elementary/exact/wide/coefficients.h"

namespace hpccd::exact::wide {

inline constexpr int time_bits = 62;

struct Dyadic {  // m / 2^k
  Big m;
  int k;
};

class Root {
 public:
  explicit Root(Dyadic x) : low_(x.m), high_(std::move(x.m)), k_(x.k), exact_(true) {}
  // The only root of p between low and high, which is simple; p has the sign `before` at low and the opposite one at
  // high. The ends are extrema or inflection points of p or next to them, or the ends of the step.
  Root(Coefficients p, const Dyadic& low, const Dyadic& high, int before);

  Coefficients of() const { return of_; }  // unless exact
  bool exact() const { return exact_; }
  Dyadic low() const { return absolute(low_); }  // of the open interval that contains it; the root itself if exact
  Dyadic high() const { return absolute(high_); }

  // q as a polynomial in the offset from the base, times a power of two, and the sign that it certainly has on the
  // interval; 0: not certain. The base is chosen when the root is first narrowed; until then it is 0, and seen(q) is q.
  std::vector<Big> seen(Coefficients q) const;
  int sign_of_seen(Coefficients seen) const { return exact_ ? 0 : sign_on(seen, low_, high_, k_); }
  bool changes_sign(Coefficients q) const;
  // Whether the intervals prove that the other root is in this one's interval; false: unknown.
  bool surely_holds(const Root& other) const;
  bool has_base() const { return has_base_; }
  int known_bits() const { return has_base_ ? k_ : 0; }  // of its offset

  // A factor of `of`, with fewer bits or of a lower degree, that has the root as well.
  void set_factor(std::vector<Big> factor);

  void narrow();

  // floor(root * 2^62)
  std::int64_t time();

 private:
  void become_exact(Dyadic x);
  void approach();
  void approach_from(const Dyadic& end, bool upwards, int limit);
  void set_base(Dyadic base, Big low, Big high, int unit);
  void step();
  Dyadic absolute(const Big& offset) const;

  std::vector<Big> of_, local_;  // local_ = seen(of_), once there is a base
  Dyadic base_{0, 0};
  int unit_ = 0;    // offsets are multiples of 2^-(unit + k)
  Big low_, high_;  // offsets
  int k_;
  int before_ = 0;
  bool exact_ = false, has_base_ = false;
};

}  // namespace hpccd::exact::wide
