// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/wide/common_roots.h"

#include <algorithm>

#include "elementary/exact/integers.h"

namespace hpccd::exact::wide {
namespace {

// Integers modulo a prime of 62 bits: numbers that differ from zero here do so as integers, at a hundredth of the cost.
class Residue {
 public:
  // A prime of no special form, since coordinates are sums of powers of two.
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

template <class Number, class Zero>
void trim(std::vector<Number>& p, Zero&& is_zero) {
  while (!p.empty() && is_zero(p.back())) p.pop_back();
}

// The last remainder that is not zero. `reduce` keeps its numbers small.
template <class Number, class Zero, class Reduce>
std::vector<Number> last_remainder(std::vector<Number> f, std::vector<Number> g, Zero&& is_zero, Reduce&& reduce) {
  if (f.size() < g.size()) f.swap(g);
  while (!g.empty()) {
    if (g.size() == 1) return g;
    f = pseudo_remainder(std::move(f), g);
    trim(f, is_zero);
    reduce(f);
    f.swap(g);
  }
  return f;
}

void drop_content(Numbers& p) {
  if (p.empty()) return;
  Big content = abs(p.back());
  for (const Big& c : p)
    if (!c.is_zero()) content = gcd(content, c);
  for (Big& c : p) c /= content;
}

}  // namespace

bool certainly_no_common_root(Coefficients f, Coefficients g) {
  auto a = copied<Residue>(f), b = copied<Residue>(g);
  if (a.back().zero() || b.back().zero()) return false;
  return last_remainder(std::move(a), std::move(b), [](Residue x) { return x.zero(); }, [](auto&) {}).size() == 1;
}

Numbers common_factor(Coefficients f, Coefficients g) {
  if (certainly_no_common_root(f, g)) return {1};
  Numbers a = copied<Big>(f), b = copied<Big>(g);
  drop_content(a), drop_content(b);
  return last_remainder(std::move(a), std::move(b), [](const Big& x) { return x.is_zero(); }, drop_content);
}

Numbers quotient(Numbers f, const Numbers& g) {
  Numbers q(f.size() - g.size() + 1);
  // A multiple of f that the leading coefficient of g divides at every step.
  Big factor = 1;
  for (std::size_t i = 0; i < q.size(); ++i) factor *= g.back();
  for (Big& c : f) c *= factor;
  for (std::size_t i = q.size(); i-- > 0;) {
    q[i] = f[i + g.size() - 1] / g.back();
    for (std::size_t j = 0; j < g.size(); ++j) f[i + j] -= q[i] * g[j];
  }
  drop_content(q);
  return q;
}

bool divides(const Numbers& g, Coefficients f) {
  const Numbers rest = pseudo_remainder(copied<Big>(f), g);
  return std::ranges::all_of(rest, [](const Big& x) { return x.is_zero(); });
}

Numbers square_free(Coefficients p) {
  Numbers f = copied<Big>(p);
  if (p.size() <= 2) return f;
  const Numbers repeated = common_factor(p, derivative(p));
  return repeated.size() == 1 ? f : quotient(std::move(f), repeated);
}

}  // namespace hpccd::exact::wide
