// SPDX-License-Identifier: Apache-2.0
// Common parts of the tests of the published methods: a swarm's hierarchy at a step, and what must hold of any
// hierarchy.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "base/profiler.h"
#include "bvh/motion_bounds.h"
#include "bvh/tree.h"
#include "grid_scene.h"
#include "paper/build.h"
#include "paper/hierarchy.h"
#include "swarm_scene.h"
#include "traverse/tasks.h"

namespace hpccd::paper {

struct PaperTest : testing::Test {
  std::shared_ptr<const Scene> scene = test::swarm_scene(true);
  Features features = features_of(*scene);
  PairRules rules{*scene, Accuracy::balanced, SeparationTable(*scene, 0)};
  ThreadPool pool{3};
  MotionBounds motion;
  Profiler profiler;

  // A step with little motion; between one and the next, pieces have traded places.
  void move_to(int step) {
    const auto start = test::swarm_positions(2 * step), end = test::swarm_positions(2 * step + 1);
    motion.update(test::view(start), test::view(end), pool);
    motion.sweep(pool);
  }

  Box box_of(std::uint32_t primitive) const {
    if (primitive >= features.n_faces()) return motion.swept[features.lone_vertices[primitive - features.n_faces()]];
    Box b;
    for (std::uint32_t v : features.faces[primitive]) b.include(motion.swept[v]);
    return b;
  }

  static bool same(const Box& a, const Box& b) {
    return std::equal(a.low, a.low + 3, b.low) && std::equal(a.high, a.high + 3, b.high);
  }

  // Every primitive in one leaf; children share their node's primitives and nodes between them; boxes are the union of
  // their primitives' boxes at this step; below a node of one mesh all is of that mesh.
  void expect_valid(const Hierarchy& h) const {
    ASSERT_EQ(h.nodes.size(), 2 * features.n_primitives() - 1);
    std::vector<std::uint32_t> primitives = h.order;
    std::ranges::sort(primitives);
    for (std::uint32_t c = 0; c < primitives.size(); ++c) ASSERT_EQ(primitives[c], c);
    ASSERT_EQ(h.nodes[0].count, features.n_primitives());
    expect_valid(h, 0);
  }

 private:
  void expect_valid(const Hierarchy& h, NodeIndex n) const {
    const Node& node = h.nodes[n];
    Box whole;
    std::set<std::uint32_t> meshes;
    for (std::uint32_t i = node.begin; i < node.begin + node.count; ++i) {
      const Box b = box_of(h.order[i]);
      EXPECT_TRUE(same(h.primitive_boxes[h.order[i]], b)) << "primitive " << h.order[i];
      whole.include(b);
      meshes.insert(features.mesh_of_primitive[h.order[i]]);
    }
    EXPECT_TRUE(same(node.box, whole)) << "node " << n;
    EXPECT_EQ(node.mesh, meshes.size() == 1 ? *meshes.begin() : mixed_meshes) << "node " << n;
    if (!node.is_split) return;
    ASSERT_FALSE(node.is_leaf());
    const Node &l = h.nodes[Hierarchy::left(n)], &r = h.nodes[h.right(n)];
    ASSERT_GT(l.count, 0u);
    ASSERT_GT(r.count, 0u);
    ASSERT_EQ(l.begin, node.begin);
    ASSERT_EQ(r.begin, node.begin + l.count);
    ASSERT_EQ(l.count + r.count, node.count);
    ASSERT_LE(h.right(n) + 2 * r.count - 1, n + 2 * node.count - 1) << "outside the node's piece";
    expect_valid(h, Hierarchy::left(n));
    expect_valid(h, h.right(n));
  }
};

}  // namespace hpccd::paper
