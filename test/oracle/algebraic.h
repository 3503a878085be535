// SPDX-License-Identifier: Apache-2.0
// Real roots of integer polynomials in [0,1]: isolated, refined and compared with zero exactly.
#pragma once

#include <vector>

#include "polynomial.h"

namespace oracle {

// A root of a polynomial: either exactly n/2^k, or the only one in the open interval (n/2^k, (n+1)/2^k), simple there,
// at whose ends the polynomial does not vanish.
class Root {
 public:
  static Root exactly(Integer n, unsigned k) { return Root({}, std::move(n), k, true); }
  static Root between(Polynomial p, Integer n, unsigned k) { return Root(std::move(p), std::move(n), k, false); }

  // Sign of q at the root: -1, 0 or 1.
  int sign_of(const Polynomial& q);

  // The largest double that is not greater than the root.
  double rounded_down();

 private:
  Root(Polynomial p, Integer n, unsigned k, bool exact) : p_(std::move(p)), n_(std::move(n)), k_(k), exact_(exact) {}
  void refine();

  Polynomial p_;
  Integer n_;
  unsigned k_;
  bool exact_;
  unsigned subdivision_ = 2;  // the next refinement tries intervals 2^subdivision times shorter
};

// All roots in the closed interval [0,1], each once, in ascending order; p must not be the zero polynomial.
std::vector<Root> roots_in_unit_interval(const Polynomial& p);

}  // namespace oracle
