// SPDX-License-Identifier: Apache-2.0
#include "paper/upkeep.h"

#include "paper/fixture.h"

namespace hpccd::paper {
namespace {

struct UpkeepTest : PaperTest {
  UpkeepCounts counts;

  template <class Examine>
  void examine_below(const Hierarchy& h, NodeIndex n, Examine&& examine) {
    if (h.nodes[n].is_leaf()) return;
    examine(n);
    examine_below(h, Hierarchy::left(n), examine);
    examine_below(h, h.right(n), examine);
  }
};

TEST_F(UpkeepTest, RestructuringWhatATraversalReachesKeepsTheHierarchyValid) {
  Upkeep upkeep(features, true);
  for (int step = 0; step < 12; ++step) {
    move_to(step);
    upkeep.begin_step(motion.swept, pool, profiler);
    expect_valid(upkeep.hierarchy());
    // Another half of the hierarchy in each step: the other stays as it is, split or not.
    upkeep.examine(0, counts);
    const NodeIndex half = step % 2 ? Hierarchy::left(0) : upkeep.hierarchy().right(0);
    examine_below(upkeep.hierarchy(), half, [&](NodeIndex n) { upkeep.examine(n, counts); });
    expect_valid(upkeep.hierarchy());
    upkeep.end_step();
  }
  EXPECT_GT(counts.restructured, 0u);
  EXPECT_GT(counts.split_lazily, 0u);
}

TEST_F(UpkeepTest, ARestructuredNodeHasChildrenThatAreSplitWhenNeeded) {
  Upkeep upkeep(features, true);
  const Hierarchy& h = upkeep.hierarchy();
  for (int step = 0; step < 12; ++step) {
    move_to(step);
    upkeep.begin_step(motion.swept, pool, profiler);
    examine_below(h, 0, [&](NodeIndex n) {
      const UpkeepCounts before = counts;
      upkeep.examine(n, counts);
      if (counts.restructured + counts.split_lazily == before.restructured + before.split_lazily) return;
      EXPECT_FALSE(h.nodes[Hierarchy::left(n)].is_split);
      EXPECT_FALSE(h.nodes[h.right(n)].is_split);
    });
    upkeep.end_step();
  }
  EXPECT_GT(counts.restructured, 0u);
}

TEST_F(UpkeepTest, ANodeIsExaminedOnceAStep) {
  Upkeep upkeep(features, true);
  for (int step = 0; step < 12; ++step) {
    move_to(step);
    upkeep.begin_step(motion.swept, pool, profiler);
    const auto all = [&] { examine_below(upkeep.hierarchy(), 0, [&](NodeIndex n) { upkeep.examine(n, counts); }); };
    all();
    const std::vector<std::uint32_t> order = upkeep.hierarchy().order;
    const UpkeepCounts after_first = counts;
    all();
    EXPECT_EQ(upkeep.hierarchy().order, order);
    EXPECT_EQ(counts.restructured, after_first.restructured);
    EXPECT_EQ(counts.split_lazily, after_first.split_lazily);
    upkeep.end_step();
  }
}

TEST_F(UpkeepTest, WithoutRestructuringTheOrderStays) {
  Upkeep upkeep(features, false);
  move_to(0);
  upkeep.begin_step(motion.swept, pool, profiler);
  upkeep.end_step();
  const std::vector<std::uint32_t> order = upkeep.hierarchy().order;
  for (int step = 1; step < 12; ++step) {
    move_to(step);
    upkeep.begin_step(motion.swept, pool, profiler);
    examine_below(upkeep.hierarchy(), 0, [&](NodeIndex n) { upkeep.examine(n, counts); });
    upkeep.end_step();
  }
  EXPECT_EQ(upkeep.hierarchy().order, order);
  EXPECT_EQ(counts.restructured, 0u);
}

TEST_F(UpkeepTest, RestructuringMendsTheCulling) {
  double restructured = 0, worn = 0;
  for (const bool restructure : {true, false}) {
    Upkeep upkeep(features, restructure);
    for (int step = 0; step < 12; ++step) {
      move_to(step);
      upkeep.begin_step(motion.swept, pool, profiler);
      examine_below(upkeep.hierarchy(), 0, [&](NodeIndex n) { upkeep.examine(n, counts); });
      upkeep.end_step();
    }
    double area = 0;
    for (const Node& n : upkeep.hierarchy().nodes) area += n.box.half_area();
    (restructure ? restructured : worn) = area;
  }
  EXPECT_LT(restructured, 0.8 * worn);
}

TEST_F(UpkeepTest, AnInterruptedStepIsFollowedByANewHierarchy) {
  Upkeep upkeep(features, true);
  move_to(0);
  upkeep.begin_step(motion.swept, pool, profiler);  // no end_step
  Profiler next;
  next.begin();
  upkeep.begin_step(motion.swept, pool, next);
  EXPECT_TRUE(next.stages().contains("build"));
  expect_valid(upkeep.hierarchy());
}

// The high-level nodes and the naive method rely on this: all threads examine all nodes at once.
TEST_F(UpkeepTest, ThreadsThatMeetAtNodesSeeOneHierarchy) {
  Upkeep upkeep(features, true);
  std::uint64_t restructured = 0;
  for (int step = 0; step < 12; ++step) {
    move_to(step);
    upkeep.begin_step(motion.swept, pool, profiler);
    std::vector<UpkeepCounts> counts_of(static_cast<std::size_t>(pool.size()));
    std::vector<std::uint64_t> visited(counts_of.size());
    pool.run([&](int thread) {
      examine_below(upkeep.hierarchy(), 0, [&](NodeIndex n) {
        upkeep.examine_locked(n, counts_of[thread]);
        ++visited[thread];
      });
    });
    for (std::uint64_t v : visited) EXPECT_EQ(v, features.n_primitives() - 1);
    for (const UpkeepCounts& c : counts_of) restructured += c.restructured;
    expect_valid(upkeep.hierarchy());
    upkeep.end_step();
  }
  EXPECT_GT(restructured, 0u);
}

}  // namespace
}  // namespace hpccd::paper
