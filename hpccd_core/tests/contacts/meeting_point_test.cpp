// SPDX-License-Identifier: Apache-2.0
// Where two segments that touch meet, on awkward ones.
#include "contacts/meeting_point.h"

#include <gtest/gtest.h>

namespace hpccd {
namespace {

using V = Vec3<double>;

TEST(MeetingPoint, LiesOnBothSegments) {
  const V x{1, 0, 0}, none{0, 0, 0};
  const auto apart = [](const Segment& longer, const Segment& shorter) {
    const double place = meeting_place(longer, shorter);
    EXPECT_GE(place, 0);
    EXPECT_LE(place, 1);
    const V p = shorter.at(place);
    return largest(p - longer.at(nearest_place(longer, p)));
  };
  EXPECT_EQ(meeting_place({none, 10 * x}, {9 * x, 2 * x}), 0.25) << "the middle of what they share";
  EXPECT_EQ(meeting_place({none, 10 * x}, {{11, 0, 0}, -2 * x}), 0.75);
  EXPECT_EQ(apart({none, x}, {x, x}), 0);
  EXPECT_EQ(apart({none, none}, {none, none}), 0);
  EXPECT_EQ(apart({none, x}, {0.5 * x, none}), 0);
  for (const double tiny : {1e-300, 1e-170, 1e-18, 1e-9}) {
    EXPECT_EQ(apart({none, x}, {0.5 * x, {0, tiny, 0}}), 0);
    EXPECT_LE(apart({none, x}, {{0.5, -0.5 * tiny, 0}, {tiny, tiny, 0}}), 1e-16);
  }
  // Almost parallel, crossing anywhere, near the ends too.
  for (const double sine : {1e-2, 1e-6, 1e-8, 1e-10, 1e-13, 1e-16})
    for (const double u : {0.0, 1e-9, 0.3, 1.0 - 1e-8, 1.0})
      for (const double v : {0.0, 1e-7, 0.6, 1.0})
        for (const double length : {1.0, -0.5, 1e-3}) {
          const V along = length * V{1, sine, 0}, start = V{u, 0, 0} + -v * along;
          EXPECT_LE(apart({none, x}, {start, along}), 1e-10) << sine << " " << u << " " << v << " " << length;
        }
}

}  // namespace
}  // namespace hpccd
