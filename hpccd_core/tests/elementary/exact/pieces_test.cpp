// SPDX-License-Identifier: Apache-2.0
// The pieces' polynomials in integers of fixed size are those in integers of any size: on the widest coordinates, and
// distances of the most different scale that each size takes, nothing overflows.
#include "elementary/exact/pieces.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace hpccd::exact {
namespace {

// Numbers of magnitudes below 2^bits that reach it.
Big wide_number(std::mt19937_64& random, int bits) {
  const Big most = (Big(1) << bits) - 1;
  Big x = random() % 4 ? most : Big(Big(random()) << (bits - 64 > 0 ? bits - 64 : 0)) % most;
  return random() % 2 ? x : Big(-x);
}

template <class Z>
Z narrowed(const Big& x) {
  const Big size = abs(x);
  Z z(0);
  for (std::size_t i = 0; i < z.limbs.size(); ++i)
    z.limbs[i] = static_cast<std::uint64_t>(Big(size >> static_cast<int>(64 * i)) & ~std::uint64_t{0});
  return x.sign() < 0 ? -z : z;
}
template <>
Big narrowed<Big>(const Big& x) {
  return x;
}

// All coefficients, and those of Bernstein, which have the widest sums.
template <class Z>
std::vector<Big> numbers_of(Kind kind, const Big x[24], const Margin& d) {
  Coordinates<Z> points[4];
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 3; ++k) {
      const Z z0 = narrowed<Z>(x[3 * i + k]), z1 = narrowed<Z>(x[12 + 3 * i + k]);
      points[i][k] = {{z0, z1 - z0}};
    }
  std::vector<Big> all;
  const auto add = [&]<class X, int D>(const Polynomial<X, D>& p) {
    std::array<Plus<X, 1>, D + 1> b;
    for (int i = 0; i <= D; ++i) {
      all.push_back(to_big(p.c[i]));
      b[i] = Plus<X, 1>(p.c[i]);
    }
    to_bernstein(b.data(), D);
    for (const auto& c : b) all.push_back(to_big(c));
  };
  const Query<Z> query(kind, points);
  Pieces<Z>(query, d).visit_all([&](const auto& piece) {
    add(piece.distance), add(piece.not_zero);
    for (int i = 0; i < piece.n_at_least_zero; ++i) add(piece.at_least_zero[i]);
  });
  return all;
}

template <class Z>
void expect_same_as_big() {
  std::mt19937_64 random(9);
  constexpr int most_shift = 32 * Pieces<Z>::room;
  for (int i = 0; i < 500; ++i) {
    Big x[24];
    for (Big& number : x) number = wide_number(random, Widths<Z>::coordinate_bits);
    const Kind kind = i % 2 ? Kind::vertex_face : Kind::edge_edge;
    Margin d(1, 0);
    d.mantissa = (std::int64_t{1} << 53) - 1;
    d.shift = i % 3 == 0 ? -most_shift : i % 3 == 1 ? most_shift : 0;
    ASSERT_TRUE(Pieces<Z>::fits(d));
    ASSERT_EQ(numbers_of<Z>(kind, x, d), numbers_of<Big>(kind, x, d)) << "query " << i;
  }
}

TEST(ExactPieces, OfOneLimbAreThoseOfAnySize) { expect_same_as_big<Integer<1>>(); }
TEST(ExactPieces, OfTwoLimbsAreThoseOfAnySize) { expect_same_as_big<Integer<2>>(); }

}  // namespace
}  // namespace hpccd::exact
