// SPDX-License-Identifier: Apache-2.0
// The candidates for intersections of two leaves: with every instruction set just the edges and faces whose boxes at
// t = 0 overlap and that share no vertex, except for edges that are certainly on one side of the face's plane.
#include "traverse/leaf_edge_faces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>

#include "base/simd.h"
#include "bvh/motion_bounds.h"
#include "elementary/exact/intersection.h"
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
  std::vector<double> positions = test::sheet_positions(side, 0.5, lone);

  // The sheets cross halfway.
  void crumple(double by) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> way(-by, by);
    for (double& x : positions) x += way(random);
  }
  void build_tree() {
    motion.update(*scene, test::view(positions), pool);
    build(tree, *scene, features, motion, pool);
  }

  Vec3<double> at(std::uint32_t v) const { return {positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]}; }

  // In double precision. Volumes are six times as large as those of the tetrahedra.
  struct Heights {
    double one, other;
    bool on_one_side(double beyond) const { return std::min(one, other) > beyond || std::max(one, other) < -beyond; }
  };
  Heights heights(std::uint32_t edge, std::uint32_t face) const {
    const auto& corner = features.faces[face];
    const Vec3<double> n = cross(at(corner[1]) - at(corner[0]), at(corner[2]) - at(corner[0]));
    const auto height = [&](std::uint32_t v) { return dot(n, at(v) - at(corner[0])); };
    return {height(features.edges[edge][0]), height(features.edges[edge][1])};
  }
  bool intersect(std::uint32_t edge, std::uint32_t face) const {
    const auto& e = features.edges[edge];
    const auto& f = features.faces[face];
    const Vec3<double> q[5] = {at(e[0]), at(e[1]), at(f[0]), at(f[1]), at(f[2])};
    return exact::intersect(q);
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

  // All sets find the same ones. They are missing only if the edge is on one side of the plane, and do not intersect;
  // and present only if it is not, up to rounding.
  void expect_all(double rounding, std::size_t least_within, std::size_t least, std::size_t least_missing) const {
    std::size_t within = 0, between = 0, missing = 0;
    for (const LeafRange& a : tree.leaves)
      for (const LeafRange& b : tree.leaves) {
        if (&b < &a) continue;
        const Pairs expected = one_by_one(a, b), found = by(Simd::scalar, a, b);
        ASSERT_TRUE(std::ranges::includes(expected, found));
        for (const auto& [edge, face] : found) EXPECT_FALSE(heights(edge, face).on_one_side(rounding));
        Pairs left_out;
        std::ranges::set_difference(expected, found, std::back_inserter(left_out));
        for (const auto& [edge, face] : left_out) {
          EXPECT_TRUE(heights(edge, face).on_one_side(0));
          EXPECT_FALSE(intersect(edge, face));
        }
        (&a == &b ? within : between) += found.size();
        missing += left_out.size();
        for (const Simd simd : simd_levels())
          ASSERT_EQ(by(simd, a, b), found)
              << "leaves " << &a - tree.leaves.data() << " and " << &b - tree.leaves.data() << ", " << name_of(simd);
      }
    EXPECT_GE(within, least_within);
    EXPECT_GE(between, least);
    EXPECT_GE(missing, least_missing);
  }
};

// In flat sheets no edge is close to a face of its own leaf.
TEST_F(LeafEdgeFacesTest, AreThoseThatOverlapAndShareNoVertexNorLieBesideThePlane) {
  crumple(0.5);
  build_tree();
  expect_all(1e-2, 5, 1000, 1000);
}

// Nearly flat, far from the origin, by less than the rounding of the boxes: planes must leave whatever is undecided.
TEST_F(LeafEdgeFacesTest, LeaveWhatRoundingHides) {
  for (const double by : {1e-12, 1e-8, 1e-7, 1e-6, 1e-5, 1e-3}) {
    positions.clear();
    for (std::uint32_t sheet = 0; sheet < test::sheets; ++sheet) {
      for (std::uint32_t i = 0; i < side * side; ++i)
        positions.insert(positions.end(), {1e3 + i % side + 0.31 * sheet, 1e3 + i / side + 0.17 * sheet, 1e3});
      for (std::uint32_t i = 0; i < lone; ++i) positions.insert(positions.end(), {1e3, 1e3, 1e3});
    }
    crumple(by);
    build_tree();
    expect_all(1e-2, 0, 1000, 0);
  }
}

// Coordinates that are bent have no planes.
TEST_F(LeafEdgeFacesTest, AreAllThatOverlapInBentCoordinates) {
  crumple(0.5);
  build_tree();
  const auto missing = [&] {
    std::size_t n = 0;
    for (const LeafRange& a : tree.leaves)
      for (const LeafRange& b : tree.leaves)
        if (&a <= &b) n += one_by_one(a, b).size() - by(Simd::scalar, a, b).size();
    return n;
  };
  EXPECT_GT(missing(), 0u);
  tree.bent = true;
  EXPECT_EQ(missing(), 0u);
}

}  // namespace
}  // namespace hpccd
