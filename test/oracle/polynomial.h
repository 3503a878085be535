// SPDX-License-Identifier: Apache-2.0
// Polynomials in one variable with integer coefficients of any size.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "integers.h"
#include "vec.h"

namespace oracle {

// Coefficients from the constant term upwards, without leading zeros; the zero polynomial has none.
class Polynomial {
 public:
  Polynomial() = default;
  explicit Polynomial(std::vector<Integer> coefficients) : c_(std::move(coefficients)) {
    while (!c_.empty() && c_.back() == 0) c_.pop_back();
  }

  bool is_zero() const { return c_.empty(); }
  int degree() const { return static_cast<int>(c_.size()) - 1; }
  const Integer& operator[](int i) const { return c_[static_cast<std::size_t>(i)]; }
  const Integer& leading() const { return c_.back(); }

 private:
  std::vector<Integer> c_;
};

// a + b or, for a negative sign, a - b.
inline Polynomial combined(const Polynomial& a, const Polynomial& b, int sign) {
  std::vector<Integer> sum(static_cast<std::size_t>(std::max(a.degree(), b.degree()) + 1));
  for (int i = 0; i <= a.degree(); ++i) sum[static_cast<std::size_t>(i)] = a[i];
  for (int i = 0; i <= b.degree(); ++i) {
    if (sign < 0)
      sum[static_cast<std::size_t>(i)] -= b[i];
    else
      sum[static_cast<std::size_t>(i)] += b[i];
  }
  return Polynomial(std::move(sum));
}

inline Polynomial operator+(const Polynomial& a, const Polynomial& b) { return combined(a, b, 1); }
inline Polynomial operator-(const Polynomial& a, const Polynomial& b) { return combined(a, b, -1); }

inline Polynomial operator*(const Polynomial& a, const Polynomial& b) {
  if (a.is_zero() || b.is_zero()) return {};
  std::vector<Integer> product(static_cast<std::size_t>(a.degree() + b.degree() + 1));
  for (int i = 0; i <= a.degree(); ++i)
    for (int j = 0; j <= b.degree(); ++j) product[static_cast<std::size_t>(i + j)] += a[i] * b[j];
  return Polynomial(std::move(product));
}

inline Polynomial derivative(const Polynomial& p) {
  std::vector<Integer> d;
  for (int i = 1; i <= p.degree(); ++i) d.push_back(i * p[i]);
  return Polynomial(std::move(d));
}

// The polynomial divided by the greatest common divisor of its coefficients.
inline Polynomial primitive_part(const Polynomial& p) {
  Integer content = 0;
  for (int i = 0; i <= p.degree(); ++i) content = gcd(content, p[i]);
  std::vector<Integer> c;
  for (int i = 0; i <= p.degree(); ++i) c.push_back(p[i] / content);
  return Polynomial(std::move(c));
}

struct Division {
  Polynomial quotient, remainder;
};

// Division after scaling the dividend so that it stays within the integers:
// leading(b)^k * a = quotient * b + remainder for some k, degree(remainder) < degree(b).
inline Division pseudo_divide(const Polynomial& a, const Polynomial& b) {
  Polynomial quotient, remainder = a;
  const Polynomial scale({b.leading()});
  while (remainder.degree() >= b.degree()) {
    std::vector<Integer> term(static_cast<std::size_t>(remainder.degree() - b.degree() + 1));
    term.back() = remainder.leading();
    const Polynomial step(std::move(term));
    quotient = scale * quotient + step;
    remainder = scale * remainder - step * b;
  }
  return {quotient, remainder};
}

// Greatest common divisor up to a constant factor; neither polynomial may be zero.
inline Polynomial common_divisor(Polynomial a, Polynomial b) {
  while (!b.is_zero()) {
    Polynomial r = pseudo_divide(a, b).remainder;
    a = std::move(b);
    b = r.is_zero() ? r : primitive_part(r);
  }
  return a;
}

// A polynomial with the same roots, each of them simple.
inline Polynomial square_free_part(const Polynomial& p) {
  if (p.degree() < 2) return p;
  return primitive_part(pseudo_divide(p, common_divisor(p, derivative(p))).quotient);
}

using Vector = Vec<Polynomial>;

}  // namespace oracle
