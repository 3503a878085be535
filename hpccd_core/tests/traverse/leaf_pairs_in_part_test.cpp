// SPDX-License-Identifier: Apache-2.0
// The candidates of two leaves in a part of a motion: none is left out that overlaps in it, by exact boxes of that
// time, and every instruction set finds the same.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <set>
#include <string>

#include "base/simd.h"
#include "bvh/motion_bounds.h"
#include "grid_scene.h"
#include "soup_scene.h"
#include "traverse/leaf_pairs.h"
#include "traverse/search.h"

namespace hpccd {
namespace {

using Pair = std::pair<std::uint32_t, std::uint32_t>;

struct Found {
  std::set<Pair> edge_edge, vertex_face;
  bool operator==(const Found&) const = default;
};

// Scenes of sheets, or of a soup, whose leaves have more corners than a row has lanes.
struct LeafPairsInPart : testing::TestWithParam<bool> {
  static constexpr std::uint32_t side = 13, triangles = 150;
  std::shared_ptr<const Scene> scene = GetParam() ? test::soup_scene(triangles) : test::two_sheets(side, 0);
  Features features = features_of(*scene);
  ThreadPool pool{1};
  MotionBounds motion;
  Tree tree;

  LeafPairsInPart() {
    const auto start = GetParam() ? test::soup_positions(triangles, 1) : test::sheet_positions(side, 0, 0),
               end = GetParam() ? test::soup_positions(triangles, 2) : test::sheet_positions(side, 1, 0);
    motion.update(test::view(start), test::view(end), pool);
    build(tree, *scene, features, motion, pool);
  }

  // Apart at the start and apart in the same order at this time, along an axis.
  template <class VerticesA, class VerticesB>
  bool may_touch(const VerticesA& a, const VerticesB& b, double time) const {
    if (std::ranges::find_first_of(a, b) != std::ranges::end(a)) return false;
    for (int k = 0; k < 3; ++k) {
      const auto range = [&](const auto& vertices, double t) {
        double low = INFINITY, high = -INFINITY;
        for (const std::uint32_t v : vertices) {
          const double x = motion.vertices[v].t0[k] + t * (motion.vertices[v].t1[k] - motion.vertices[v].t0[k]);
          low = std::min(low, x), high = std::max(high, x);
        }
        return std::pair(low, high);
      };
      const auto a0 = range(a, 0), b0 = range(b, 0), a1 = range(a, time), b1 = range(b, time);
      if ((a0.second < b0.first && a1.second < b1.first) || (b0.second < a0.first && b1.second < a1.first))
        return false;
    }
    return true;
  }

  template <class Function>
  void each_pair(const LeafRange& a, const LeafRange& b, Function&& f) const {
    for (auto i = a.first_edge; i < a.end_edge; ++i)
      for (auto j = &a == &b ? i + 1 : b.first_edge; j < b.end_edge; ++j) {
        const Pair p = std::minmax(tree.edge_of_slot[i], tree.edge_of_slot[j]);
        f(Kind::edge_edge, p, features.edges[p.first], features.edges[p.second]);
      }
    const auto faces = [&](const LeafRange& x, const LeafRange& y) {
      for (auto i = x.first_vertex; i < x.end_vertex; ++i)
        for (auto j = y.first_face; j < y.end_face; ++j) {
          const Pair p{tree.vertex_of_slot[i], tree.face_of_slot[j]};
          f(Kind::vertex_face, p, std::array{p.first}, features.faces[p.second]);
        }
    };
    faces(a, b);
    if (&a != &b) faces(b, a);
  }

  template <class LeafPairsOfPart>
  Found by(LeafPairsOfPart leaf_pairs, const LeafRange& a, const LeafRange& b, float part) const {
    const auto edge_edge = std::make_unique<CandidateBuffer>(), vertex_face = std::make_unique<CandidateBuffer>();
    leaf_pairs(tree, a, b, TestedFeatures{}, part, *edge_edge, *vertex_face);
    Found found;
    for (std::uint32_t i = 0; i < edge_edge->n; ++i)
      found.edge_edge.insert({edge_edge->first[i], edge_edge->second[i]});
    for (std::uint32_t i = 0; i < vertex_face->n; ++i)
      found.vertex_face.insert({vertex_face->first[i], vertex_face->second[i]});
    EXPECT_EQ(found.edge_edge.size(), edge_edge->n);
    EXPECT_EQ(found.vertex_face.size(), vertex_face->n);
    return found;
  }

  template <class OfSimd>
  std::size_t expect_all(OfSimd of_simd, float part, double time) const {
    std::size_t n = 0;
    for (std::size_t x = 0; x < tree.leaves.size(); ++x)
      for (std::size_t y = x; y < tree.leaves.size(); ++y) {
        const LeafRange &a = tree.leaves[x], &b = tree.leaves[y];
        const Found first = by(of_simd(Simd::scalar), a, b, part);
        for (const Simd simd : simd_levels()) EXPECT_EQ(by(of_simd(simd), a, b, part), first) << name_of(simd);
        each_pair(a, b, [&](Kind kind, const Pair& pair, const auto& of_a, const auto& of_b) {
          if (!may_touch(of_a, of_b, time)) return;
          const auto& list = kind == Kind::edge_edge ? first.edge_edge : first.vertex_face;
          EXPECT_TRUE(list.contains(pair)) << pair.first << " " << pair.second << " up to " << time;
        });
        n += first.edge_edge.size() + first.vertex_face.size();
      }
    return n;
  }
};

TEST_P(LeafPairsInPart, UpToATimeNoneIsMissed) {
  std::size_t last = 0;
  for (const float time : {1e-6f, 1e-3f, 0.1f, 0.5f, 0.999f}) {
    const std::size_t n = expect_all([](Simd simd) { return leaf_pairs_until(simd); }, time, double{time});
    EXPECT_GE(n, last);
    last = n;
  }
  EXPECT_GT(last, 1000u);
}

TEST_P(LeafPairsInPart, AtTheStartBoxesGrowByTheWay) {
  double way = 0;
  for (const VertexMotion& v : motion.vertices)
    for (int k = 0; k < 3; ++k) way = std::max(way, std::fabs(v.t1[k] - v.t0[k]));
  const PairRules rules(*scene, Accuracy::exact, SeparationTable(*scene, 0));
  ContactSearch search(tree, rules, Simd::scalar);
  search.prunes = true;
  search.two_ways = static_cast<float>(2 * way * motion.map.scale);
  search.most_reach = INFINITY;
  for (const double time : {1e-9, 1e-6, 1e-3, 0.1, 0.5}) {
    search.earliest = time;
    const PartOfMotion part = search.part();
    EXPECT_GT(part.until, time);
    expect_all([](Simd simd) { return leaf_pairs_at_start(simd); }, part.reach, time);
  }
  search.earliest = 1;
  EXPECT_GE(search.part().until, 1);
}

TEST_P(LeafPairsInPart, WhatAChildOverlapsItsParentDoes) {
  std::size_t n = 0;
  for (const float time : {1e-6f, 1e-3f, 0.3f})
    for (const Node& a : tree.nodes) {
      if (!a.children) continue;
      for (const Node& b : tree.nodes)
        for (std::uint32_t i = 0; i < 2; ++i) {
          const Node& child = tree.nodes[a.children + i];
          if (!child.overlap_until(b, time)) continue;
          ++n;
          EXPECT_TRUE(a.overlap_until(b, time));
        }
    }
  EXPECT_GT(n, 1000u);
}

INSTANTIATE_TEST_SUITE_P(Scenes, LeafPairsInPart, testing::Bool(),
                         [](const auto& info) { return std::string(info.param ? "Soup" : "Sheets"); });

}  // namespace
}  // namespace hpccd
