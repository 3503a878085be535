// SPDX-License-Identifier: Apache-2.0
#include "paper/front.h"

#include "base/simd.h"
#include "paper/fixture.h"
#include "paper/refit.h"

namespace hpccd::paper {
namespace {

using PairSet = std::set<std::pair<NodeIndex, NodeIndex>>;

struct FrontTest : PaperTest {
  Hierarchy h;
  Ancestry ancestry;
  Tree tree;
  ContactSearch search{tree, rules, Simd::scalar};
  Worker worker;
  FrontCounts counts;

  void SetUp() override {
    move_to(0);
    build(h, features, motion.swept, pool);
    ancestry = Ancestry(h);
  }

  Scenery scenery() const { return {h, features, rules, motion.swept}; }

  std::vector<FrontSegment> update(const std::vector<FrontSegment>& front) {
    search.geometry = {motion.vertices.data(), features.edges.data(), features.faces.data(), motion.kdops.data()};
    worker.begin(search);
    const Scenery s = scenery();
    std::vector<std::vector<FrontSegment>> kept;
    FrontUpdate one(s, ancestry, worker, counts);
    for (const FrontSegment& segment : front) kept.push_back(one(segment));
    worker.flush();
    return joined(std::move(kept));
  }

  PairSet as_set(const std::vector<FrontSegment>& front) {
    PairSet pairs;
    for (const FrontSegment& segment : front)
      for (const Pair& p : segment) EXPECT_TRUE(pairs.insert({p.a, p.b}).second) << p.a << " and " << p.b << " twice";
    return pairs;
  }
};

TEST_F(FrontTest, ParentsAreThePairsThatRefinementCameFrom) {
  const Scenery s = scenery();
  std::vector<Pair> stack{{0, 0}};
  std::size_t checked = 0;
  while (!stack.empty()) {
    const Pair p = stack.back();
    stack.pop_back();
    if (!enabled(s, p) || !overlaps(s, p) || is_leaf_pair(s, p)) continue;
    refine(
        h, p, [](NodeIndex) {},
        [&](Pair q) {
          if (q.a != q.b) {
            EXPECT_EQ(ancestry.parent(q), p);
            ++checked;
          }
          stack.push_back(q);
        });
  }
  EXPECT_GT(checked, 1000u);
}

TEST_F(FrontTest, AKeptFrontIsTheFrontOfATraversalFromTheRoot) {
  std::vector<FrontSegment> front{{{0, 0}}};
  for (int step = 0; step < 10; ++step) {
    move_to(step);
    refit(h, features, motion.swept, pool);
    // Cut into pieces of all sizes, so that runs of pairs that climb to one are cut as well.
    std::vector<FrontSegment> cut;
    std::size_t length = 1;
    for (const FrontSegment& segment : front)
      for (std::size_t i = 0; i < segment.size(); i += length, length = length % 7 + 1)
        cut.emplace_back(segment.begin() + static_cast<std::ptrdiff_t>(i),
                         segment.begin() + static_cast<std::ptrdiff_t>(std::min(i + length, segment.size())));
    front = update(cut);
    const PairSet kept = as_set(front);
    const std::uint64_t tested = worker.counts[0].tested + worker.counts[1].tested;
    const PairSet rebuilt = as_set(update({{{0, 0}}}));
    EXPECT_EQ(kept, rebuilt) << "step " << step;
    EXPECT_EQ(tested, worker.counts[0].tested + worker.counts[1].tested);
  }
  EXPECT_GT(counts.ascended, 0u);
}

}  // namespace
}  // namespace hpccd::paper
