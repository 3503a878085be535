// SPDX-License-Identifier: Apache-2.0
// The predicate against a linear program: an edge and a face share a point where some weights of their corners, not
// negative and one in sum on each side, give the same point.
#include "elementary/exact/intersection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>

#include "elementary/exact/integers.h"

namespace hpccd::exact {
namespace {

using Corners = std::array<std::array<double, 3>, 5>;  // the edge's two ends, then the face's three corners

bool intersect(const Corners& c) {
  Vec3<double> q[5];
  for (int i = 0; i < 5; ++i) q[i] = {c[i][0], c[i][1], c[i][2]};
  return exact::intersect(q);
}

// Columns: the corners' coordinates, negative those of the face; one for the edge's sum and one for the face's. All
// entries stay integers (Bareiss 1968): they are minors of the matrix.
template <class Z>
bool has_solution(const std::array<std::array<Z, 3>, 5>& corners, unsigned columns) {
  std::array<std::array<Z, 6>, 5> rows;
  int n = 0;
  for (int i = 0; i < 5; ++i)
    if (columns >> i & 1) {
      const bool edge = i < 2;
      for (int k = 0; k < 3; ++k) rows[k][n] = edge ? corners[i][k] : Z(-corners[i][k]);
      rows[3][n] = edge, rows[4][n] = !edge;
      ++n;
    }
  for (int k = 0; k < 5; ++k) rows[k][n] = k >= 3;
  Z previous = 1;
  for (int i = 0; i < n; ++i) {
    int pivot = i;
    while (pivot < 5 && rows[pivot][i] == 0) ++pivot;
    if (pivot == 5) return false;  // dependent columns: a smaller set of them does as well
    std::swap(rows[i], rows[pivot]);
    for (int k = 0; k < 5; ++k) {
      if (k == i) continue;
      const Z factor = rows[k][i];
      for (int j = 0; j <= n; ++j) rows[k][j] = Z(rows[k][j] * rows[i][i] - factor * rows[i][j]) / previous;
    }
    previous = rows[i][i];
  }
  for (int k = n; k < 5; ++k)
    if (rows[k][n] != 0) return false;
  for (int i = 0; i < n; ++i)
    if ((rows[i][n] < 0) != (rows[i][i] < 0) && rows[i][n] != 0) return false;
  return true;
}

// Where a linear program can be satisfied, a set of independent columns alone does it.
template <class Z>
bool brute_force(const std::array<std::array<Z, 3>, 5>& corners) {
  for (unsigned columns = 1; columns < 32; ++columns)
    if (has_solution(corners, columns)) return true;
  return false;
}

__extension__ typedef __int128 Int128;

bool brute_force_on_lattice(const Corners& c) {
  std::array<std::array<Int128, 3>, 5> corners;
  for (int i = 0; i < 5; ++i)
    for (int k = 0; k < 3; ++k) corners[i][k] = static_cast<Int128>(c[i][k]);
  return brute_force(corners);
}

bool brute_force_on_reals(const Corners& c) {
  std::array<std::array<Big, 3>, 5> corners;
  for (int k = 0; k < 3; ++k) {
    int low = 0;
    for (int i = 0; i < 5; ++i)
      if (c[i][k] != 0) low = std::min(low, std::ilogb(c[i][k]) - 52);
    for (int i = 0; i < 5; ++i) {
      int exponent = 0;
      const double fraction = std::frexp(c[i][k], &exponent);
      const Big mantissa(static_cast<std::int64_t>(std::ldexp(fraction, 53)));
      corners[i][k] =
          mantissa == 0 ? mantissa : Big(mantissa * pow(Big(2), static_cast<unsigned>(exponent - 53 - low)));
    }
  }
  return brute_force(corners);
}

// Small integers: on few values every degeneracy is common.
Corners on_lattice(std::mt19937_64& random) {
  const int most = 1 + static_cast<int>(random() % 4), flat = static_cast<int>(random() % 6);
  std::uniform_int_distribution<int> whole(-most, most);
  Corners c;
  for (auto& corner : c)
    for (int k = 0; k < 3; ++k) corner[k] = k == flat ? 0 : whole(random);
  const auto corner = [&] { return random() % 5; };
  if (random() % 4 == 0) c[corner()] = c[corner()];
  if (random() % 4 == 0) {  // three on a line
    const auto from = c[corner()], to = c[corner()];
    const int times = whole(random);
    auto& on_line = c[corner()];
    for (int k = 0; k < 3; ++k) on_line[k] = from[k] + times * (to[k] - from[k]);
  }
  return c;
}

struct Counts {
  int yes = 0, no = 0;
  void operator()(bool answer) { ++(answer ? yes : no); }
  void expect_both(int least) const {
    EXPECT_GT(yes, least);
    EXPECT_GT(no, least);
  }
};

TEST(ExactIntersection, OnALatticeIsThatOfTheLinearProgram) {
  std::mt19937_64 random(5);
  Counts counts;
  for (int i = 0; i < 40000; ++i) {
    const Corners c = on_lattice(random);
    const bool truth = brute_force_on_lattice(c);
    ASSERT_EQ(intersect(c), truth) << "query " << i;
    counts(truth);
  }
  counts.expect_both(5000);
}

// Two limbs and integers of any size, and numbers that would under- or overflow: powers of two along each axis, which
// change no result. A first corner far away keeps the range of bits wide.
TEST(ExactIntersection, DoesNotDependOnTheScaleOfAnAxis) {
  std::mt19937_64 random(6);
  Counts counts;
  for (int i = 0; i < 20000; ++i) {
    Corners c = on_lattice(random);
    const bool truth = intersect(c);
    for (int k = 0; k < 3; ++k) {
      const int exponent = static_cast<int>(random() % 1500) - 1000;
      for (auto& corner : c) corner[k] = std::ldexp(corner[k], exponent);
    }
    ASSERT_EQ(intersect(c), truth) << "query " << i;
    counts(truth);
  }
  counts.expect_both(2000);
}

// Corners that are moved by the least that a double can be, or by much less than its unit: 5 * 2^-1074 to 2^480.
TEST(ExactIntersection, OfEveryRangeOfBitsIsThatOfTheLinearProgram) {
  std::mt19937_64 random(7);
  const double tiny[] = {0, 0, 0x1p-40, -0x1p-60, 0x1p-110, -0x1p-128, 5 * 0x1p-1074, -0x1p-1074};
  Counts counts;
  int changed = 0;
  for (int i = 0; i < 2000; ++i) {
    Corners c = on_lattice(random);
    const bool before = intersect(c);
    const double large = random() % 3 ? 1 : 0x1p480;
    for (auto& corner : c)
      for (double& x : corner) x = x == 0 ? tiny[random() % 8] : x * (random() % 8 ? 1 : large) + tiny[random() % 8];
    const bool truth = brute_force_on_reals(c);
    ASSERT_EQ(intersect(c), truth) << "query " << i;
    counts(truth);
    changed += truth != before;
  }
  counts.expect_both(200);
  EXPECT_GT(changed, 50);
}

TEST(ExactIntersection, OfRealsIsThatOfTheLinearProgram) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> real(-1, 1);
  Counts counts;
  for (int i = 0; i < 2000; ++i) {
    Corners c;
    for (auto& corner : c)
      for (double& x : corner) x = i % 2 ? real(random) : static_cast<double>(static_cast<float>(real(random)));
    const bool truth = brute_force_on_reals(c);
    ASSERT_EQ(intersect(c), truth) << "query " << i;
    counts(truth);
  }
  counts.expect_both(100);
}

}  // namespace
}  // namespace hpccd::exact
