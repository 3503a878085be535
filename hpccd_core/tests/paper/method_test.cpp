// SPDX-License-Identifier: Apache-2.0
// Every method, on any number of threads, gives what the default traversal gives; what the sanitizers are run on.
#include <gtest/gtest.h>

#include "equal_contacts.h"
#include "grid_scene.h"
#include "swarm_scene.h"

namespace hpccd {
namespace {

constexpr Method methods[] = {Method::published, Method::naive, Method::front};

Contacts detect(Detector& detector, int step) {
  const auto start = test::swarm_positions(step), end = test::swarm_positions(step + 1);
  return detector.detect(test::view(start), test::view(end));
}

void compare_over_steps(Options options, bool rules, std::initializer_list<int> threads, int steps) {
  options.backend = Backend::cpu;
  options.threads = 1;
  Detector standard(test::swarm_scene(rules), options);
  std::vector<std::unique_ptr<Detector>> others;
  for (Method method : methods)
    for (int n : threads) {
      Options o = options;
      o.method = method;
      o.threads = n;
      others.push_back(std::make_unique<Detector>(test::swarm_scene(rules), o));
    }
  std::size_t found = 0;
  for (int step = 0; step < steps; ++step) {
    const Contacts expected = detect(standard, step);
    found += expected.vf.size() + expected.ee.size();
    for (auto& other : others) {
      SCOPED_TRACE("method " + std::to_string(static_cast<int>(other->options().method)) + ", threads " +
                   std::to_string(other->options().threads) + ", step " + std::to_string(step));
      test::expect_equal(expected, detect(*other, step));
      if (options.report == Report::all)
        for (const char* count : {"vf_candidates", "ee_candidates"}) {
          // Boxes of the sweep, in all of these methods, leave more than those of both ends.
          EXPECT_EQ(other->stats().at(count), others.front()->stats().at(count));
          EXPECT_GE(other->stats().at(count), standard.stats().at(count));
        }
    }
  }
  EXPECT_GT(found, options.report == Report::all ? 500u : 0u);
}

TEST(Methods, AllContactsOfManyMeshes) {
  compare_over_steps({.accuracy = Accuracy::balanced}, false, {1, 2, 3, 4, 8, 16}, 6);
}

TEST(Methods, RulesOfPairsOfMeshes) {
  compare_over_steps({.accuracy = Accuracy::balanced}, true, {1, 2, 3, 4, 8, 16}, 6);
}

TEST(Methods, WithoutRestructuring) {
  compare_over_steps({.accuracy = Accuracy::balanced, .restructure = false}, true, {1, 4}, 6);
}

TEST(Methods, FirstContacts) {
  compare_over_steps({.accuracy = Accuracy::balanced, .report = Report::first}, true, {1, 3, 8}, 4);
}

TEST(Methods, MoreThreadsThanTriangles) {
  auto scene = std::make_shared<Scene>();
  scene->add_mesh("two", std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5}, 6, {});
  const std::vector<double> start{0, 0, 0, 1, 0, 0, 0, 1, 0, 0.2, 0.2, 1, 0.2, 0.4, 1, 0.2, 0.2, 2};
  std::vector<double> end = start;
  for (int v = 3; v < 6; ++v) end[3 * v + 2] -= 1.5;
  for (Method method : methods) {
    Detector detector(scene, {.backend = Backend::cpu, .threads = 8, .method = method});
    for (int i = 0; i < 3; ++i) EXPECT_EQ(detector.detect(test::view(start), test::view(end)).vf.size(), 2u);
  }
}

TEST(Methods, ScenesWithoutPairs) {
  auto empty = std::make_shared<Scene>(), lone = std::make_shared<Scene>(), rigid = std::make_shared<Scene>();
  lone->add_mesh("vertices", std::vector<std::uint32_t>{}, 2, {});
  rigid->add_mesh("body", std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5}, 6, {.self_collision = false});
  const std::vector<double> positions(18, 0.5);
  for (Method method : methods)
    for (const auto& scene : {empty, lone, rigid}) {
      Detector detector(scene, {.backend = Backend::cpu, .threads = 4, .method = method});
      const Positions p{positions.data(), scene->n_vertices(), true};
      for (int i = 0; i < 2; ++i) EXPECT_EQ(detector.detect(p, p).hash, 0u);
    }
}

TEST(Methods, OneContactOfManyIsRefused) {
  for (Method method : methods)
    EXPECT_THROW(Detector(test::swarm_scene(true), {.report = Report::any, .method = method}), InvalidArgument);
}

TEST(Methods, PublishedRestructuresAndReassigns) {
  Detector detector(
      test::swarm_scene(false),
      {.accuracy = Accuracy::balanced, .backend = Backend::cpu, .threads = 3, .method = Method::published});
  std::uint64_t restructured = 0;
  for (int step = 0; step < 10; ++step) {
    detect(detector, step);
    const auto stats = detector.stats();
    restructured += stats.at("nodes_restructured");
    EXPECT_EQ(stats.at("tasks_reassigned") + 3, stats.at("task_requests"))
        << "each thread asks in vain once, at the end";
  }
  EXPECT_GT(restructured, 0u);
}

}  // namespace
}  // namespace hpccd
