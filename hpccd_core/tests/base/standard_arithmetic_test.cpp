// SPDX-License-Identifier: Apache-2.0
// Results do not depend on the floating-point mode of the calling thread, which is restored afterwards.
#include "base/standard_arithmetic.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <random>

#include "base/parallel.h"
#include "contacts/parts.h"
#include "equal_contacts.h"
#include "grid_scene.h"
#include "hpccd/hpccd.h"
#include "other_arithmetic.h"
#include "rigid/arm.h"
#include "rigid/joint_bounds.h"
#include "rigid/placed_vertices.h"
#include "soup_scene.h"

namespace hpccd {
namespace {

using test::OtherArithmetic;
using test::seen_arithmetic;

class InOtherModes : public ::testing::TestWithParam<int> {};

TEST_P(InOtherModes, TheModeIsSetAndSetBack) {
  const OtherArithmetic other(GetParam());
  const auto before = seen_arithmetic();
  ASSERT_NE(before, test::standard_arithmetic);
  {
    const StandardArithmetic arithmetic;
    EXPECT_EQ(seen_arithmetic(), test::standard_arithmetic);
    const StandardArithmetic nested;
    EXPECT_EQ(seen_arithmetic(), test::standard_arithmetic);
  }
  EXPECT_EQ(seen_arithmetic(), before);
}

TEST_P(InOtherModes, ThreadsOfAPoolHaveTheStandardOne) {
  const OtherArithmetic other(GetParam());
  ThreadPool pool(3);
  std::vector<test::SeenArithmetic> seen(3);
  pool.run([&](int thread) { seen[thread] = seen_arithmetic(); });
  EXPECT_EQ(seen[0], seen_arithmetic()) << "the caller's own";
  EXPECT_EQ(seen[1], test::standard_arithmetic);
  EXPECT_EQ(seen[2], test::standard_arithmetic);
}

struct Answers {
  std::vector<bool> hits;
  std::vector<double> times;
  bool operator==(const Answers&) const = default;
};

Answers elementary_answers(const std::vector<Query>& queries) {
  Answers answers;
  for (const auto test : {test_vertex_face, test_edge_edge})
    for (const double d : {0.0, 2e-310}) {
      const auto hit = std::make_unique<bool[]>(queries.size());
      std::vector<double> toc(queries.size());
      Options options;
      options.minimum_separation = d;
      test(queries, options, hit.get(), toc.data());
      answers.hits.insert(answers.hits.end(), hit.get(), hit.get() + queries.size());
      answers.times.insert(answers.times.end(), toc.begin(), toc.end());
    }
  return answers;
}

TEST_P(InOtherModes, ElementaryQueries) {
  std::mt19937 random(1);
  std::vector<Query> queries(400);
  for (std::size_t i = 0; i < queries.size(); ++i)
    for (double& x : queries[i]) x = (i % 2 ? 1e-310 : 0.1) * (static_cast<int>(random() % 19) - 9);
  const Answers expected = elementary_answers(queries);
  const OtherArithmetic other(GetParam());
  const auto before = seen_arithmetic();
  const Answers found = elementary_answers(queries);
  EXPECT_EQ(seen_arithmetic(), before);
  {
    const StandardArithmetic comparing;
    EXPECT_EQ(found, expected);
  }
  queries[7][3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(elementary_answers(queries), InvalidArgument);
  EXPECT_EQ(seen_arithmetic(), before);
}

struct SceneAnswers {
  Contacts contacts;
  Proximity near;
  Intersections hits;
  std::vector<Gap> gaps;
  double step;
};

constexpr std::uint32_t n_triangles = 60;

struct Step {
  std::vector<double> t0, t1;
  double separation;
};

Step step_at_scale(int exponent) {
  Step step{test::soup_positions(n_triangles, 1), test::soup_positions(n_triangles, 2), std::ldexp(0.125, exponent)};
  for (auto* positions : {&step.t0, &step.t1})
    for (double& x : *positions) x = std::ldexp(x, exponent);
  return step;
}

SceneAnswers scene_answers(const Step& step) {
  Options options;
  options.threads = 3;
  options.backend = Backend::cpu;
  options.points = options.normals = options.closest = true;
  Detector detector(test::soup_scene(n_triangles), options);
  const Positions t0 = test::view(step.t0), t1 = test::view(step.t1);
  detector.set_separation(0, 1, step.separation);
  return {detector.detect(t0, t1), detector.proximity(t0, step.separation), detector.intersections(t0),
          detector.distances(t0), detector.collision_free_step(t0, t1)};
}

TEST_P(InOtherModes, Detectors) {
  for (const int exponent : {0, -1040}) {
    const Step step = step_at_scale(exponent);
    const SceneAnswers expected = scene_answers(step);
    ASSERT_GT(expected.contacts.vf.size(), 20u);
    ASSERT_GT(expected.near.ee.size(), 20u);
    const OtherArithmetic other(GetParam());
    const auto before = seen_arithmetic();
    const SceneAnswers found = scene_answers(step);
    EXPECT_EQ(seen_arithmetic(), before);
    const StandardArithmetic comparing;
    test::expect_equal(found.contacts, expected.contacts);
    EXPECT_EQ(found.contacts.points, expected.contacts.points);
    EXPECT_EQ(found.contacts.normals, expected.contacts.normals);
    EXPECT_EQ(found.contacts.closest, expected.contacts.closest);
    EXPECT_EQ(found.near.hash, expected.near.hash);
    EXPECT_EQ(found.hits.hash, expected.hits.hash);
    EXPECT_EQ(found.step, expected.step);
    ASSERT_EQ(found.gaps.size(), expected.gaps.size());
    for (std::size_t i = 0; i < found.gaps.size(); ++i) EXPECT_EQ(found.gaps[i].distance, expected.gaps[i].distance);
  }
}

TEST_P(InOtherModes, AThrowingDetectorLeavesTheMode) {
  const OtherArithmetic other(GetParam());
  const auto before = seen_arithmetic();
  Detector detector(test::soup_scene(n_triangles), {});
  std::vector<double> bad = test::soup_positions(n_triangles, 1);
  bad[5] = std::numeric_limits<double>::infinity();
  EXPECT_THROW(detector.detect(test::view(bad), test::view(bad)), InvalidArgument);
  EXPECT_EQ(seen_arithmetic(), before);
}

TEST_P(InOtherModes, JointsAndParts) {
  using rigid::JointKind;
  const auto arm = test::arm({JointKind::turning, JointKind::sliding, JointKind::turning});
  const std::vector<double> start{0.1, 1e-310, 0.7}, end{0.3, 3e-310, -0.9};
  const auto ask = [&] {
    const auto poses = arm->poses(start, {});
    const rigid::JointBounds bounds(arm, start, end, {});
    const auto b = bounds.of_link(2, {0.4, 0.3, {0.1, 1e-310, 0.2}});
    std::vector<rigid::Vector> vertex{{1e-310, 0.1, 0.3}}, placed(1);
    rigid::place_vertices(poses, std::vector<rigid::LinkMesh>{{2, 1}}, vertex, placed);
    const std::vector<std::array<std::uint32_t, 2>> vf{{0, 0}};
    const std::vector<double> toc{3e-310};
    ContactsOfPart part{};
    part.vf = vf, part.vf_toc = toc, part.part = 0, part.parts = 3;
    const Contacts step = contacts_of_step(std::vector{part});
    return std::vector<double>{b.acceleration, b.span,          b.rounding,     placed[0].x,   placed[0].y,
                               placed[0].z,    poses[2].turn.z, step.vf_toc[0], step.first_toc};
  };
  const std::vector<double> expected = ask();
  const OtherArithmetic other(GetParam());
  const std::vector<double> found = ask();
  const StandardArithmetic comparing;
  EXPECT_EQ(found, expected);
}

INSTANTIATE_TEST_SUITE_P(All, InOtherModes, ::testing::ValuesIn(test::other_modes));

}  // namespace
}  // namespace hpccd
