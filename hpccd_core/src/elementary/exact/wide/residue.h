// SPDX-License-Identifier: Apache-2.0
// Integers modulo a prime of 62 bits: what differs from zero here does so there, at a hundredth of the price.
#pragma once

#include "elementary/exact/integers.h"

namespace hpccd::exact::wide {

class Residue {
 public:
  // Of no special form: coordinates are sums of powers of two.
  static constexpr std::uint64_t prime = 4349154017897750603;

  Residue() = default;
  explicit Residue(const Big& x) {
    const auto& limbs = x.backend();
    static_assert(sizeof(*limbs.limbs()) == 8);
    for (unsigned i = limbs.size(); i-- > 0;)
      r_ = static_cast<std::uint64_t>((DoubleLimb{r_} << 64 | limbs.limbs()[i]) % prime);
    if (x.sign() < 0 && r_) r_ = prime - r_;
  }

  bool zero() const { return r_ == 0; }
  friend Residue operator*(Residue a, Residue b) {
    return Residue(static_cast<std::uint64_t>(DoubleLimb{a.r_} * b.r_ % prime));
  }
  friend Residue operator-(Residue a, Residue b) { return Residue(a.r_ < b.r_ ? a.r_ + prime - b.r_ : a.r_ - b.r_); }

 private:
  explicit Residue(std::uint64_t r) : r_(r) {}
  std::uint64_t r_ = 0;
};

}  // namespace hpccd::exact::wide
