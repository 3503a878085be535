// SPDX-License-Identifier: Apache-2.0
// Tested features, of the whole scene and by pair of meshes: the full result with the other kind left out, from
// every way to find it.
#include <gtest/gtest.h>

#include <algorithm>

#include "base/simd.h"
#include "equal_contacts.h"
#include "grid_scene.h"
#include "swarm_scene.h"

namespace hpccd {
namespace {

constexpr std::uint32_t side = 15;
constexpr TestedFeatures only_vertex_face{.edge_edge = false}, only_edge_edge{.vertex_face = false};
constexpr TestedFeatures selections[] = {{}, only_vertex_face, only_edge_edge};

// Without what is not tested, by the meshes of the two features.
template <class Tested>
Contacts filtered(const Contacts& all, Tested&& tested) {
  Contacts kept;
  for (std::size_t i = 0; i < all.vf.size(); ++i)
    if (tested(all.vf[i][0], all.vf[i][1], true).vertex_face)
      kept.vf.push_back(all.vf[i]), kept.vf_toc.push_back(all.vf_toc[i]);
  for (std::size_t i = 0; i < all.ee.size(); ++i)
    if (tested(all.ee[i][0], all.ee[i][2], false).edge_edge)
      kept.ee.push_back(all.ee[i]), kept.ee_toc.push_back(all.ee_toc[i]);
  for (const auto* tocs : {&kept.vf_toc, &kept.ee_toc})
    for (const double toc : *tocs) kept.first_toc = std::min(kept.first_toc, toc);
  return kept;
}

Contacts filtered(const Contacts& all, TestedFeatures features) {
  return filtered(all, [&](std::uint32_t, std::uint32_t, bool) { return features; });
}

void expect_same(const Contacts& found, const Contacts& expected) {
  EXPECT_EQ(found.vf, expected.vf);
  EXPECT_EQ(found.ee, expected.ee);
  EXPECT_EQ(found.vf_toc, expected.vf_toc);
  EXPECT_EQ(found.ee_toc, expected.ee_toc);
  EXPECT_EQ(found.first_toc, expected.first_toc);
}

struct Steps {
  std::shared_ptr<const Scene> scene = test::two_sheets(side, 2);
  std::vector<double> start = test::sheet_positions(side, 0, 2), end = test::sheet_positions(side, 1, 2);

  Detector detector(Options options) const {
    options.backend = Backend::cpu;
    return {scene, options};
  }
  Contacts detect(const Options& options) const {
    Detector d = detector(options);
    return d.detect(test::view(start), test::view(end));
  }
};

TEST(TestedFeatures, AreTheFullAnswersByEveryMethodTierAndInstructionSet) {
  const Steps steps;
  for (const Accuracy accuracy : {Accuracy::fast, Accuracy::balanced, Accuracy::conservative, Accuracy::exact})
    for (const double separation : {0.0, 0.05}) {
      const Contacts all = steps.detect({.accuracy = accuracy, .minimum_separation = separation});
      ASSERT_GT(all.vf.size(), 100u);
      ASSERT_GT(all.ee.size(), 100u);
      for (const TestedFeatures features : selections) {
        const Contacts expected = filtered(all, features);
        const Contacts first =
            steps.detect({.accuracy = accuracy, .minimum_separation = separation, .features = features});
        expect_same(first, expected);
        for (const Method method : {Method::standard, Method::published, Method::naive, Method::front})
          for (const Simd simd : simd_levels())
            for (const int threads : {1, 3})
              test::expect_equal(steps.detect({.accuracy = accuracy,
                                               .simd = simd,
                                               .threads = threads,
                                               .minimum_separation = separation,
                                               .method = method,
                                               .features = features}),
                                 first);
      }
    }
}

TEST(TestedFeatures, OfTheEarliestContactsAndOfOne) {
  const Steps steps;
  const Contacts all = steps.detect({});
  for (const TestedFeatures features : selections) {
    const double first = filtered(all, features).first_toc;
    ASSERT_LT(first, 1);
    Contacts earliest = steps.detect({.report = Report::first, .features = features});
    EXPECT_EQ(earliest.first_toc, first);
    EXPECT_TRUE(features.vertex_face || earliest.vf.empty());
    EXPECT_TRUE(features.edge_edge || earliest.ee.empty());
    const Contacts one = steps.detect({.report = Report::any, .features = features});
    EXPECT_EQ(one.vf.size() + one.ee.size(), 1u);
    EXPECT_TRUE(features.vertex_face || one.vf.empty());
    EXPECT_TRUE(features.edge_edge || one.ee.empty());
    Detector d = steps.detector({.features = features});
    for (int call = 0; call < 4; ++call) {  // from the tree, then from the list of near pairs
      const double step = d.collision_free_step(test::view(steps.start), test::view(steps.end));
      EXPECT_LE(step, first);
      EXPECT_GE(step, first - 1e-9);
    }
  }
}

TEST(TestedFeatures, OfProximity) {
  const Steps steps;
  const auto near = [&](TestedFeatures features) {
    Detector d = steps.detector({.features = features});
    return d.proximity(test::view(steps.start), 0.7);
  };
  const Proximity all = near({}), faces = near(only_vertex_face), edges = near(only_edge_edge);
  ASSERT_GT(all.vf.size(), 100u);
  ASSERT_GT(all.ee.size(), 100u);
  EXPECT_EQ(faces.vf, all.vf);
  EXPECT_EQ(faces.vf_distance, all.vf_distance);
  EXPECT_TRUE(faces.ee.empty());
  EXPECT_EQ(edges.ee, all.ee);
  EXPECT_EQ(edges.ee_distance, all.ee_distance);
  EXPECT_TRUE(edges.vf.empty());
}

TEST(TestedFeatures, LeaveIntersectionsAndDistancesAsTheyAre) {
  const Steps steps;
  Detector both = steps.detector({});
  for (const TestedFeatures features : selections) {
    Detector d = steps.detector({.features = features});
    for (const double t : {0.0, 0.4, 0.5, 0.6, 1.0}) {  // between steps, after which boxes of edges may be old
      d.detect(test::view(steps.start), test::view(steps.end));
      const auto now = test::sheet_positions(side, t, 2);
      EXPECT_EQ(d.intersections(test::view(now)).ef, both.intersections(test::view(now)).ef);
      d.detect(test::view(steps.start), test::view(steps.end));
      const auto gaps = d.distances(test::view(now)), expected = both.distances(test::view(now));
      ASSERT_EQ(gaps.size(), expected.size());
      for (std::size_t i = 0; i < gaps.size(); ++i) {
        EXPECT_EQ(gaps[i].distance, expected[i].distance);
        EXPECT_EQ(gaps[i].kind, expected[i].kind);
        EXPECT_EQ(gaps[i].features, expected[i].features);
      }
    }
  }
}

TEST(TestedFeatures, ComparesNoEdgesWhereNoneAreTested) {
  const Steps steps;
  for (const Method method : {Method::standard, Method::published, Method::naive, Method::front}) {
    Detector d = steps.detector({.method = method, .features = only_vertex_face});
    d.detect(test::view(steps.start), test::view(steps.end));
    auto stats = d.stats();
    EXPECT_GT(stats["vf_candidates"], 0u);
    EXPECT_EQ(stats["ee_candidates"], 0u);
    Detector other = steps.detector({.method = method, .features = only_edge_edge});
    other.detect(test::view(steps.start), test::view(steps.end));
    stats = other.stats();
    EXPECT_EQ(stats["vf_candidates"], 0u);
    EXPECT_GT(stats["ee_candidates"], 0u);
  }
}

// Static meshes keep their bounds from call to call: of queries of another kind they have others.
TEST(TestedFeatures, WhatRestsIsAskedForAllFeaturesToo) {
  auto scene = std::make_shared<Scene>();
  scene->add_mesh("floor", test::sheet_faces(side), side * side, {.is_static = true});
  scene->add_mesh("sheet", test::sheet_faces(side), side * side, {});
  const auto floor = test::sheet_positions(side, 0);
  const auto at = [&](double t) {
    auto positions = test::sheet_positions(side, t);
    std::copy_n(floor.begin(), 3 * side * side, positions.begin());
    return positions;
  };
  const auto start = at(0), middle = at(0.55), end = at(1);
  Detector d(scene, {.backend = Backend::cpu, .features = only_vertex_face}), both(scene, {.backend = Backend::cpu});
  const auto expected = both.intersections(test::view(middle)).ef;
  ASSERT_GT(expected.size(), 10u);
  const double gap = both.distances(test::view(start)).at(0).distance;
  for (int round = 0; round < 2; ++round) {
    d.detect(test::view(start), test::view(end));
    d.proximity(test::view(middle), 0.01);
    EXPECT_EQ(d.intersections(test::view(middle)).ef, expected);
    d.detect(test::view(start), test::view(end));
    d.proximity(test::view(start), 0.01);
    EXPECT_EQ(d.distances(test::view(start)).at(0).distance, gap);
  }
}

TEST(TestedFeatures, ByPairOfMeshes) {
  const auto plain = test::swarm_scene(true);
  auto scene = std::make_shared<Scene>(*plain);
  scene->set_features(0, 1, only_vertex_face);
  scene->set_features(3, 1, only_edge_edge);  // the floor
  scene->set_features(2, 2, only_edge_edge);
  std::vector<std::uint32_t> mesh_of_vertex, mesh_of_face;
  for (std::uint32_t m = 0; m < scene->meshes().size(); ++m) {
    mesh_of_vertex.insert(mesh_of_vertex.end(), scene->meshes()[m].n_vertices, m);
    mesh_of_face.insert(mesh_of_face.end(), scene->meshes()[m].n_faces, m);
  }
  for (const TestedFeatures otherwise : selections)
    for (const Method method : {Method::standard, Method::published, Method::naive, Method::front}) {
      Detector full(plain, {.backend = Backend::cpu, .threads = 2});
      Detector part(scene, {.backend = Backend::cpu, .threads = 2, .method = method, .features = otherwise});
      std::size_t left_out = 0;
      for (int step = 0; step < 6; ++step) {
        const auto start = test::swarm_positions(step), end = test::swarm_positions(step + 1);
        const Contacts all = full.detect(test::view(start), test::view(end));
        const Contacts expected = filtered(all, [&](std::uint32_t a, std::uint32_t b, bool face) {
          return scene->pair_features(mesh_of_vertex[a], face ? mesh_of_face[b] : mesh_of_vertex[b], otherwise);
        });
        left_out += all.vf.size() + all.ee.size() - expected.vf.size() - expected.ee.size();
        expect_same(part.detect(test::view(start), test::view(end)), expected);
        const double free = part.collision_free_step(test::view(start), test::view(end));
        const double first = std::min(expected.first_toc, 1.0);
        EXPECT_TRUE(first - 1e-9 <= free && free <= first) << step;
      }
      EXPECT_GT(left_out, 100u);
    }
}

TEST(TestedFeatures, OfNothingAreRefused) {
  const TestedFeatures none{false, false};
  const Steps steps;
  EXPECT_THROW(steps.detector({.features = none}), InvalidArgument);
  Scene scene = *steps.scene;
  EXPECT_THROW(scene.set_features(0, 1, none), InvalidArgument);
  EXPECT_THROW(scene.set_features(0, test::sheets, {}), InvalidArgument);
  EXPECT_THROW(scene.set_features(test::sheets, 0, {}), InvalidArgument);
}

}  // namespace
}  // namespace hpccd
