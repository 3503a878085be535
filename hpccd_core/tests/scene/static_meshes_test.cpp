// SPDX-License-Identifier: Apache-2.0
// Data of static meshes kept from step to step never changes a result: every step equals that of a new detector.
#include <gtest/gtest.h>

#include <limits>

#include "bvh/motion_bounds.h"
#include "grid_scene.h"

namespace hpccd {
namespace {

constexpr std::uint32_t side = 12, n_static = side * side;

struct Frame {
  std::vector<double> start, end;
};

// The lower sheet rests at `place`; the upper one moves from time t0 to t1, `far` away.
Frame frame(double t0, double t1, double place = 0, double far = 0) {
  const auto make = [&](double t) {
    std::vector<double> x = test::sheet_positions(side, t);
    const std::vector<double> still = test::sheet_positions(side, 0);
    std::copy(still.begin(), still.begin() + 3 * n_static, x.begin());
    for (std::uint32_t v = 0; v < x.size() / 3; ++v)
      x[3 * v + 2] += v < n_static ? place : 0, x[3 * v] += v < n_static ? 0 : far;
    return x;
  };
  return {make(t0), make(t1)};
}

struct StaticMeshesTest : testing::TestWithParam<int> {
  std::shared_ptr<const Scene> scene = [] {
    auto s = std::make_shared<Scene>();
    s->add_mesh("still", test::sheet_faces(side), n_static, {.is_static = true});
    s->add_mesh("moving", test::sheet_faces(side), n_static, {});
    return s;
  }();
  Options options = [] {
    Options o;
    o.backend = Backend::cpu, o.threads = GetParam();
    return o;
  }();
  Detector kept{scene, options};

  static Positions as_float(const std::vector<double>& x, std::vector<float>& copy) {
    copy.assign(x.begin(), x.end());
    return {copy.data(), copy.size() / 3, false};
  }

  // The number of contacts, the same with both.
  std::size_t expect_as_new(const Frame& f, bool single = false) {
    std::vector<float> start, end;
    const Positions t0 = single ? as_float(f.start, start) : test::view(f.start);
    const Positions t1 = single ? as_float(f.end, end) : test::view(f.end);
    const Contacts a = kept.detect(t0, t1), b = Detector(scene, options).detect(t0, t1);
    EXPECT_EQ(a.vf, b.vf);
    EXPECT_EQ(a.ee, b.ee);
    EXPECT_EQ(a.hash, b.hash);
    return a.vf.size() + a.ee.size();
  }
};

TEST_P(StaticMeshesTest, AStreamOfSteps) {
  std::size_t contacts = 0;
  for (int i = 0; i < 10; ++i) contacts += expect_as_new(frame(0.1 * i, 0.1 * i + 0.1));
  EXPECT_GT(contacts, 100u);
}

TEST_P(StaticMeshesTest, PutElsewhereBetweenSteps) {
  EXPECT_GT(expect_as_new(frame(0.4, 0.7)), 0u);
  EXPECT_EQ(expect_as_new(frame(0.4, 0.7, -5)), 0u);
  EXPECT_EQ(expect_as_new(frame(0.4, 0.7, -5)), 0u);
  EXPECT_GT(expect_as_new(frame(0.4, 0.7)), 0u);
}

TEST_P(StaticMeshesTest, OtherMeshesFlyFarAway) {
  for (double far : {0.0, 1.0, 1e3, 1e3, 0.0, 1e9, -1e9, 0.0}) expect_as_new(frame(0.4, 0.7, 0, far));
  EXPECT_GT(expect_as_new(frame(0.4, 0.7)), 0u);
}

TEST_P(StaticMeshesTest, FloatsAndDoublesInTurn) {
  for (bool single : {true, true, false, true, false}) EXPECT_GT(expect_as_new(frame(0.4, 0.7, 0.01), single), 0u);
}

TEST_P(StaticMeshesTest, AfterRefusedSteps) {
  const Frame good = frame(0.4, 0.7);
  EXPECT_GT(expect_as_new(good), 0u);
  Frame bad = frame(0.4, 0.7, -5);
  bad.end[3 * n_static] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(kept.detect(test::view(bad.start), test::view(bad.end)), InvalidArgument);
  EXPECT_EQ(expect_as_new(frame(0.4, 0.7, -5)), 0u);
  Frame moving = good;
  moving.end[0] += 1;
  EXPECT_THROW(kept.detect(test::view(moving.start), test::view(moving.end)), InvalidArgument);
  EXPECT_GT(expect_as_new(good), 0u);
}

INSTANTIATE_TEST_SUITE_P(Threads, StaticMeshesTest, testing::Values(1, 4));

TEST(MotionBounds, TellsWhatRestsInALargeScene) {
  Scene scene;
  scene.add_mesh("still", test::sheet_faces(side), n_static, {.is_static = true});
  scene.add_mesh("moving", test::sheet_faces(side), n_static, {});
  ThreadPool pool(2);
  MotionBounds motion;
  const auto update = [&](const Frame& f) { motion.update(scene, test::view(f.start), test::view(f.end), {}, pool); };
  update(frame(0.40, 0.41));
  EXPECT_TRUE(motion.resting.empty());
  update(frame(0.41, 0.42));
  EXPECT_EQ(motion.resting, (std::vector<char>{1, 0}));
  update(frame(0.42, 0.43, 0.5));
  EXPECT_TRUE(motion.resting.empty() || motion.resting == (std::vector<char>{0, 0}));
  update(frame(0.42, 0.43, 0.5, 1e6));  // another map of coordinates
  EXPECT_TRUE(motion.resting.empty());
}

}  // namespace
}  // namespace hpccd
