// SPDX-License-Identifier: Apache-2.0
// The filter by k-DOPs: never a pair that touches, the same pairs with every instruction set, and nothing that the
// question in double precision does not confirm.
#include "elementary/kdop_filter.h"

#include <gtest/gtest.h>

#include <random>

#include "base/simd.h"
#include "elementary/batch.h"

namespace hpccd {
namespace {

struct Pairs {
  std::vector<VertexMotion> rows;
  std::vector<VertexKdop> kdops;
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<std::array<std::uint32_t, 3>> faces;
  std::vector<std::uint32_t> first, second;

  Geometry geometry() const { return {rows.data(), edges.data(), faces.data(), kdops.data()}; }
};

Vec3<double> point(const double* x) { return {x[0], x[1], x[2]}; }

// Pairs of features around `offset`, on a lattice, so that many touch exactly on their borders.
Pairs random_pairs(Kind kind, unsigned seed, double offset) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> lattice(-4, 4);
  Pairs p;
  CoordinateMap map;
  for (double& c : map.center) c = offset;
  for (std::uint32_t i = 0; i < batch_capacity; ++i) {
    for (int v = 0; v < 4; ++v) {
      VertexMotion row{};
      for (int k = 0; k < 3; ++k) {
        row.t0[k] = offset + 0.25 * lattice(random) + (v >= 2 ? 0.5 : 0);
        row.t1[k] = row.t0[k] + 0.25 * lattice(random);
      }
      p.rows.push_back(row);
      p.kdops.push_back(vertex_kdop(point(row.t0), point(row.t1), map));
    }
    p.edges.push_back({4 * i, 4 * i + 1});
    p.edges.push_back({4 * i + 2, 4 * i + 3});
    p.faces.push_back({4 * i + 1, 4 * i + 2, 4 * i + 3});
    p.first.push_back(kind == Kind::vertex_face ? 4 * i : 2 * i);
    p.second.push_back(kind == Kind::vertex_face ? i : 2 * i + 1);
  }
  return p;
}

// As slow and plain as can be.
bool in_order_along_a_direction(Kind kind, const VertexKdop* rows) {
  const int n_first = kind == Kind::vertex_face ? 1 : 2;
  const auto all_below = [&](const float (VertexKdop::*end)[n_kdop_directions], int k, int begin, int stop) {
    for (int i = begin; i < stop; ++i)
      for (int j = 0; j < 4; ++j)
        if ((j < begin || j >= stop) && !((rows[i].*end)[k] < (rows[j].*end)[k])) return false;
    return true;
  };
  for (int k = 0; k < n_kdop_directions; ++k) {
    if (all_below(&VertexKdop::t0, k, 0, n_first) && all_below(&VertexKdop::t1, k, 0, n_first)) return true;
    if (all_below(&VertexKdop::t0, k, n_first, 4) && all_below(&VertexKdop::t1, k, n_first, 4)) return true;
  }
  return false;
}

struct KdopFilterTest : testing::TestWithParam<double> {};

TEST_P(KdopFilterTest, LeaveOutOnlyPairsThatAreApart) {
  for (Kind kind : {Kind::vertex_face, Kind::edge_edge})
    for (unsigned seed = 0; seed < 20; ++seed) {
      const Pairs p = random_pairs(kind, seed, GetParam());
      std::vector<Query> queries(batch_capacity);
      std::vector<char> confirmed(batch_capacity);
      for (std::uint32_t i = 0; i < batch_capacity; ++i) {
        Vec3<double> t0[4], t1[4];
        for (std::uint32_t v = 0; v < 4; ++v) {
          t0[v] = point(p.rows[4 * i + v].t0), t1[v] = point(p.rows[4 * i + v].t1);
          std::copy_n(p.rows[4 * i + v].t0, 3, &queries[i][3 * v]);
          std::copy_n(p.rows[4 * i + v].t1, 3, &queries[i][12 + 3 * v]);
        }
        confirmed[i] = kind == Kind::vertex_face ? apart<Kind::vertex_face>(t0, t1) : apart<Kind::edge_edge>(t0, t1);
      }
      // Exact arithmetic, without k-DOPs.
      const auto hit = std::make_unique<bool[]>(batch_capacity);
      std::vector<double> toc(batch_capacity);
      (kind == Kind::vertex_face ? test_vertex_face : test_edge_edge)(queries, {}, hit.get(), toc.data());
      std::uint64_t hits = 0, left_out = 0, along_directions = 0;
      for (std::uint32_t i = 0; i < batch_capacity; ++i) {
        hits += hit[i], left_out += confirmed[i], along_directions += in_order_along_a_direction(kind, &p.kdops[4 * i]);
        EXPECT_FALSE(hit[i] && confirmed[i]) << "pair " << i << " of seed " << seed;
      }
      EXPECT_GT(hits, 10u);
      EXPECT_GT(left_out, 10u);
      // The counts show what each instruction set leaves out: of the pairs apart in double precision, floats may
      // miss some; they may find no other.
      std::uint64_t rejected = batch_capacity + 1;
      for (Simd simd : simd_levels()) {
        auto result = std::make_unique<BatchResult>();
        batch_test(simd, Accuracy::exact)(p.geometry(), kind, p.first.data(), p.second.data(), batch_capacity, *result);
        EXPECT_LE(result->counts.kdop, left_out);
        if (rejected <= batch_capacity) EXPECT_EQ(result->counts.kdop, rejected);
        rejected = result->counts.kdop;
      }
      EXPECT_EQ(rejected, along_directions);
      EXPECT_LE(rejected, left_out);
    }
}

INSTANTIATE_TEST_SUITE_P(Offsets, KdopFilterTest, testing::Values(0.0, 1e6, 0.1, 1e12));

}  // namespace
}  // namespace hpccd
