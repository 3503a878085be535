// SPDX-License-Identifier: Apache-2.0
// The triangle index queue: states, front pointer, window, runs of consecutive segments (Kim et al. 2009, section 5.1).
#include <gtest/gtest.h>

#include "hybrid/segment_supply.h"

namespace hpccd::hybrid {
namespace {

TriangleIndexQueue queue_of(std::size_t segments, std::size_t pairs) {
  return {std::shared_ptr<LeafPair[]>(new LeafPair[segments * pairs]), segments, pairs};
}

void expect_run(const std::optional<Run>& run, SegmentNumber first, std::size_t segments, std::size_t pairs) {
  ASSERT_TRUE(run);
  EXPECT_EQ(run->first, first);
  EXPECT_EQ(run->segments, segments);
  EXPECT_EQ(run->pairs, pairs);
}

TEST(TriangleIndexQueue, TheFrontPointerGoesFromEmptySegmentToEmptySegment) {
  TriangleIndexQueue q = queue_of(4, 8);
  for (SegmentNumber s = 0; s < 4; ++s) {
    EXPECT_EQ(q.state(s), SegmentState::empty);
    EXPECT_EQ(q.pop_empty(), s);
    EXPECT_EQ(q.state(s), SegmentState::partial);
  }
  EXPECT_FALSE(q.pop_empty());
  q.release({2, 1, 0});
  EXPECT_EQ(q.pop_empty(), 2u);
}

TEST(TriangleIndexQueue, SendsConsecutiveFullSegmentsOnceAndTogether) {
  TriangleIndexQueue q = queue_of(16, 8);  // a window of 4
  ASSERT_EQ(q.window(), 4u);
  for (int i = 0; i < 16; ++i) q.pop_empty();
  for (SegmentNumber s : {1, 2, 3, 4}) q.set_full(s, 8);
  expect_run(q.pop_run(), 1, 3, 24);  // the fourth lies beyond the window
  expect_run(q.pop_run(), 4, 1, 8);
  // Nothing is left, however often the window comes round; then a segment that was partial before is found.
  for (int i = 0; i < 8; ++i) EXPECT_FALSE(q.pop_run());
  q.set_full(0, 8);
  auto run = q.pop_run();
  for (int i = 0; i < 5 && !run; ++i) run = q.pop_run();
  expect_run(run, 0, 1, 8);
  EXPECT_EQ(q.state(0), SegmentState::full);  // until it is finished
  q.release(*run);
  EXPECT_EQ(q.state(0), SegmentState::empty);
}

TEST(TriangleIndexQueue, ARunEndsAfterASegmentThatIsNotFilledUpAndWhereTheMemoryEnds) {
  TriangleIndexQueue q = queue_of(8, 8);  // a window of 2
  for (int i = 0; i < 8; ++i) q.pop_empty();
  q.set_full(0, 8);
  q.set_full(1, 3);
  expect_run(q.pop_run(), 0, 2, 11);
  q.set_full(2, 3);
  q.set_full(3, 8);
  expect_run(q.pop_run(), 2, 1, 3);
  expect_run(q.pop_run(), 3, 1, 8);
  EXPECT_FALSE(q.pop_run());  // 4, 5
  EXPECT_FALSE(q.pop_run());  // 6, 7
  q.release({0, 2, 0});
  q.pop_empty(), q.pop_empty();
  EXPECT_FALSE(q.pop_run());  // 0, 1
  EXPECT_FALSE(q.pop_run());
  EXPECT_FALSE(q.pop_run());
  q.set_full(7, 8);
  q.set_full(0, 8);
  expect_run(q.pop_run(), 7, 1, 8);
  expect_run(q.pop_run(), 0, 1, 8);
}

TEST(SegmentSupply, BringsTwoToBeginWithAndOneForEachRequest) {
  SegmentSupply supply;
  for (SegmentNumber s : {5, 6}) {
    ASSERT_TRUE(supply.wanted());
    supply.give(s);
  }
  EXPECT_FALSE(supply.wanted());
  EXPECT_EQ(supply.receive(), 5u);
  supply.request();
  EXPECT_TRUE(supply.wanted());
  supply.give(7);
  const auto a = supply.receive(), b = supply.receive();
  EXPECT_EQ(std::minmax(*a, *b), std::minmax<SegmentNumber>(6, 7));
  EXPECT_FALSE(supply.receive());
}

}  // namespace
}  // namespace hpccd::hybrid
