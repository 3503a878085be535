// SPDX-License-Identifier: Apache-2.0
// A part of the step, and a polynomial on it in the variable s, which goes from 0 to 1 over the part.
#pragma once

#include <vector>

#include "elementary/exact/wide/coefficients.h"
#include "elementary/exact/wide/root.h"

namespace hpccd::exact::wide {

using Numbers = std::vector<Big>;

struct Window {  // [low / 2^k, low / 2^k + 2^-w], w <= k
  Big low = 0;
  int k = 0, w = 0;

  Dyadic begin() const { return {low, k}; }
  Dyadic end() const { return {low + (Big(1) << (k - w)), k}; }
  Window part(const Big& j, int h, int e) const;  // [j, j + 2^e] / 2^h of it
};

// Each of these polynomials is a positive multiple of the one that it represents. No degree exceeds 6.
Numbers seen(Coefficients p, const Window& window);
Numbers seen_on_part(const Numbers& a, const Big& j, int h, int e);  // of [0, 1]: [j, j + 2^e] / 2^h

// Sign changes among the Bernstein coefficients: the number of roots within (0, 1) with multiplicity, plus an even
// number.
int variations(const Numbers& a);

// The sign that it certainly has throughout (0, 1), by the same coefficients; 0: not certain, or zero.
int sign_inside(const Numbers& a);

// An interval in which a nonzero polynomial may have roots, inside the window and not at its ends.
class Part {
 public:
  Part(Coefficients p, Window window);

  const Window& window() const { return window_; }
  const Numbers& polynomial() const { return a_; }
  int variations() const { return variations_; }  // 0: no root; 1: one simple root

  // Narrows to a part with all variations, and so with all roots; false if none is found. Roots may differ by 1500
  // binary orders of magnitude from each other or from the start of the step: after a success, the next attempt uses
  // twice the bits.
  bool narrow();

  // Its halves, and whether the middle is a root.
  struct Halves;
  Halves halves() const;

  bool root_at_end() const;  // at the later one

 private:
  Part() = default;
  bool to_cluster(int gain);
  bool to_end(int gain);
  bool jump();
  int most_gain() const;
  bool move_to(const Big& j, int h, int e);
  void drop_root_at_begin();

  Window window_;
  Numbers a_;
  int variations_ = 0;
  int gain_ = 2;       // bits of the next attempt
  bool ends_ = false;  // whether the last cluster was not found inside: then the ends are tried too
};

struct Part::Halves {
  Part first, second;
  bool root_between;
};

}  // namespace hpccd::exact::wide
