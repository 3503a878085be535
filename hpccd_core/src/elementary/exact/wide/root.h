// SPDX-License-Identifier: Apache-2.0
// A real root in [0, 1] of an integer polynomial, as narrow as anyone asks. Coordinates may lie 1500 binary orders
// apart and roots thousands of bits from one another or from 0 and 1, so no step here gains a fixed number of bits:
// distances are found by their exponents first, then every step doubles the bits that are known.
#pragma once

#include <vector>

#include "elementary/exact/wide/coefficients.h"

namespace hpccd::exact::wide {

inline constexpr int time_bits = 62;

class Root {
 public:
  // The number m / 2^k.
  Root(Big m, int k);
  // The only root of p in (low, high) / 2^k, a simple one; p has the sign `before` at low and the opposite one at high.
  // Between a root that p turns or inflects at (or 0, or 1) and the next one.
  Root(Coefficients p, Big low, Big high, int k, int before);

  bool exact() const { return exact_; }
  const Big& low() const { return low_; }  // of the interval, times 2^k; the number itself where it is exact
  const Big& high() const { return high_; }
  int k() const { return k_; }
  Coefficients of() const { return of_; }  // unless exact

  // A factor of `of`, in fewer bits or of a lower degree, that has the root too.
  void set_factor(std::vector<Big> factor);

  void narrow();
  int known_bits() const;  // about how many bits tell it from the ends of its first interval

  // floor(root * 2^62)
  std::int64_t time();

 private:
  void become_exact(Big m, int k);
  void divide();
  void approach();
  void approach_from(const Big& base, bool upwards, int limit);
  void step();
  int sign_there(const Big& m, int k) const { return sign_at_dyadic(of_, m, k); }

  std::vector<Big> of_;
  Big low_, high_;
  int k_;
  int before_ = 0;
  bool exact_ = false;
  int rough_k_ = -1;  // k when the interval was first as long as its distance from 0, 1 and where p turns
};

}  // namespace hpccd::exact::wide
