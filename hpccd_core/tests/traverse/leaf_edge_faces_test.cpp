// SPDX-License-Identifier: Apache-2.0
// The candidates for intersections of two leaves: with every instruction set just the edges and faces whose boxes at
// t = 0 overlap and that share no vertex.
#include "traverse/leaf_edge_faces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>

#include "base/simd.h"
#include "bvh/motion_bounds.h"
#include "grid_scene.h"

namespace hpccd {
namespace {

using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

struct LeafEdgeFacesTest : testing::Test {
  static constexpr std::uint32_t side = 13, lone = 3;
  std::shared_ptr<const Scene> scene = test::two_sheets(side, lone);
  Features features = features_of(*scene);
  ThreadPool pool{1};
  MotionBounds motion;
  Tree tree;

  // The sheets cross halfway, crumpled: in flat ones no edge is close to a face of its own leaf.
  LeafEdgeFacesTest() {
    auto positions = test::sheet_positions(side, 0.5, lone);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> crumple(-0.5, 0.5);
    for (double& x : positions) x += crumple(random);
    motion.update(*scene, test::view(positions), pool);
    build(tree, *scene, features, motion, pool);
  }

  bool are_candidates(std::uint32_t edge, std::uint32_t face) const {
    MotionBox box_e, box_f;  // along the axes, and along the slanted directions
    for (const std::uint32_t v : features.edges[edge]) box_e.include(motion.boxes[v]);
    for (const std::uint32_t v : features.faces[face]) box_f.include(motion.boxes[v]);
    return box_e.t0.overlaps(box_f.t0) && box_e.t1.overlaps(box_f.t1) &&
           std::ranges::find_first_of(features.edges[edge], features.faces[face]) == features.edges[edge].end();
  }

  void add_one_by_one(const LeafRange& a, const LeafRange& b, Pairs& out) const {
    for (auto i = a.first_edge; i < a.end_edge; ++i)
      for (auto j = b.first_face; j < b.end_face; ++j) {
        const std::uint32_t edge = tree.edge_of_slot[i], face = tree.face_of_slot[j];
        if (are_candidates(edge, face)) out.push_back({edge, face});
      }
  }

  Pairs one_by_one(const LeafRange& a, const LeafRange& b) const {
    Pairs pairs;
    add_one_by_one(a, b, pairs);
    if (&a != &b) add_one_by_one(b, a, pairs);
    std::ranges::sort(pairs);
    return pairs;
  }

  Pairs by(Simd simd, const LeafRange& a, const LeafRange& b) const {
    const auto buffer = std::make_unique<CandidateBuffer>();
    leaf_edge_faces(simd)(tree, a, b, *buffer);
    EXPECT_LE(buffer->n, CandidateBuffer::most_per_call);
    Pairs pairs;
    for (std::uint32_t i = 0; i < buffer->n; ++i) pairs.push_back({buffer->first[i], buffer->second[i]});
    std::ranges::sort(pairs);
    return pairs;
  }

  void expect_all(std::size_t least) const {
    std::size_t within = 0, between = 0;
    for (const LeafRange& a : tree.leaves)
      for (const LeafRange& b : tree.leaves) {
        if (&b < &a) continue;
        const Pairs expected = one_by_one(a, b);
        (&a == &b ? within : between) += expected.size();
        for (const Simd simd : simd_levels())
          ASSERT_EQ(by(simd, a, b), expected)
              << "leaves " << &a - tree.leaves.data() << " and " << &b - tree.leaves.data() << ", " << name_of(simd);
      }
    EXPECT_GT(within, least / 50);
    EXPECT_GT(between, least);
  }
};

TEST_F(LeafEdgeFacesTest, AreThoseThatOverlapAndShareNoVertex) { expect_all(1000); }

}  // namespace
}  // namespace hpccd
