// SPDX-License-Identifier: Apache-2.0
// A cancellation is checked between any two pieces of a loop, and within the work on one pair.
#include "base/cancellation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "base/parallel.h"
#include "bvh/split.h"

namespace hpccd {
namespace {

TEST(Cancellation, ALoopEndsWithThePieceThatIsUnderWay) {
  for (int threads : {1, 4}) {
    ThreadPool pool(threads);
    Cancellation cancellation;
    pool.heed(cancellation);
    std::atomic<int> pieces{0};
    EXPECT_THROW(parallel_for(pool, 1000000, 10,
                              [&](std::size_t, std::size_t, int) {
                                if (++pieces == 100) cancellation.request();
                              }),
                 Cancelled);
    EXPECT_GE(pieces, 100);
    EXPECT_LE(pieces, 100 + 2 * threads);
    pieces = 0;
    EXPECT_THROW(parallel_for_each(pool, 2, [&](std::size_t) { ++pieces; }), Cancelled);
    EXPECT_EQ(pieces, 0);
  }
}

TEST(Cancellation, ResizedInPiecesIsResized) {
  for (const std::size_t before : {0u, 3u, 500000u})
    for (const std::size_t after : {0u, 1u, 400000u, 1234567u}) {
      std::vector<int> v(before, 7), same = v;
      resize(v, after, never_cancelled);
      same.resize(after);
      EXPECT_EQ(v, same);
    }
  std::vector<int> v(1000000);
  std::iota(v.begin(), v.end(), 0);
  const std::vector<int> same = v;
  grow(v, never_cancelled);
  EXPECT_EQ(v, same);
  EXPECT_GE(v.capacity(), 2 * v.size());
  Cancellation cancellation;
  cancellation.request();
  EXPECT_THROW(resize(v, v.size() + 5, cancellation), Cancelled);
  EXPECT_THROW(grow(v, cancellation), Cancelled);
}

TEST(Cancellation, OneSortOrSplitHowManyItMaySort) {
  constexpr std::uint32_t n = 1 << 20;
  std::vector<Centroid> set(n), scratch(n);
  for (const bool in_one_place : {false, true}) {
    for (std::uint32_t i = 0; i < n; ++i) set[i] = {{in_one_place ? 0 : static_cast<float>(i * 7919u % n), 0, 0}, i};
    Cancellation cancellation;
    split(set.data(), n, n / 3, scratch.data(), cancellation);
    EXPECT_LT(
        std::max_element(set.begin(), set.begin() + n / 3, [](auto& a, auto& b) { return a.center[0] < b.center[0]; })
            ->center[0],
        in_one_place ? 1 : n / 3);
    cancellation.request();
    EXPECT_THROW(split(set.data(), n, n / 3, scratch.data(), cancellation), Cancelled);
  }
  Cancellation cancellation;
  std::vector<int> numbers(1000);
  std::iota(numbers.rbegin(), numbers.rend(), 0);
  int looks = 0;
  EXPECT_THROW(std::sort(numbers.begin(), numbers.end(),
                         heeding(cancellation,
                                 [&](int a, int b) {
                                   if (++looks == 50) cancellation.request();
                                   return a < b;
                                 })),
               Cancelled);
  EXPECT_EQ(looks, 50);
}

}  // namespace
}  // namespace hpccd
