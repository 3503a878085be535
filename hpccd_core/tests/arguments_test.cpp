// SPDX-License-Identifier: Apache-2.0
// Invalid arguments are rejected by name and change nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "hpccd/hpccd.h"

namespace hpccd {
namespace {

// Two triangles that meet at t = 0.5.
std::shared_ptr<Scene> two_triangles() {
  auto scene = std::make_shared<Scene>();
  const std::uint32_t face[3] = {0, 1, 2};
  scene->add_mesh("a", face, 3);
  scene->add_mesh("b", face, 3);
  return scene;
}
std::vector<double> positions(double height) {
  return {0, 0, height, 1, 0, height + 1, 0, 1, height + 1, -5, -5, 0, 5, -5, 0, 0, 5, 0};
}

// The argument that the exception names: its message up to the first colon.
std::string refused(const std::function<void()>& call) {
  try {
    call();
  } catch (const InvalidArgument& error) {
    const std::string text = error.what();
    return text.substr(0, text.find(':'));
  }
  return "nothing";
}

TEST(Arguments, OptionsOutOfRange) {
  const auto with = [](auto change) {
    return refused([&] {
      Options options;
      change(options);
      Detector(two_triangles(), options);
    });
  };
  EXPECT_EQ(with([](Options& o) { o.threads = -1; }), "threads");
  EXPECT_EQ(with([](Options& o) { o.threads = 1025; }), "threads");
  EXPECT_EQ(with([](Options& o) { o.hybrid_segments = 0; }), "hybrid_segments");
  EXPECT_EQ(with([](Options& o) { o.hybrid_segment_pairs = (1 << 20) + 1; }), "hybrid_segment_pairs");
  EXPECT_EQ(with([](Options& o) { o.gpus = -1; }), "gpus");
  EXPECT_EQ(with([](Options& o) { o.gpus = 1024; }), "gpus");
  EXPECT_EQ(with([](Options& o) { o.worlds = 0; }), "worlds");
  EXPECT_EQ(with([](Options& o) { o.worlds = Options::most_worlds + 1; }), "worlds");
  EXPECT_EQ(with([](Options& o) { o.features = {false, false}; }), "features");
  EXPECT_EQ(with([](Options& o) { o.minimum_separation = -1; }), "minimum_separation");
  EXPECT_EQ(with([](Options& o) { o.minimum_separation = std::nan(""); }), "minimum_separation");
  EXPECT_EQ(with([](Options&) {}), "nothing");
}

TEST(Arguments, NumbersThatAreNoNames) {
  const auto with = [](auto change) {
    return refused([&] {
      Options options;
      change(options);
      Detector(two_triangles(), options);
    });
  };
  for (const int n : {8, 200, 255}) {
    EXPECT_EQ(with([&](Options& o) { o.accuracy = static_cast<Accuracy>(n); }), "accuracy");
    EXPECT_EQ(with([&](Options& o) { o.backend = static_cast<Backend>(n); }), "backend");
    EXPECT_EQ(with([&](Options& o) { o.report = static_cast<Report>(n); }), "report");
    EXPECT_EQ(with([&](Options& o) { o.method = static_cast<Method>(n); }), "method");
    EXPECT_EQ(with([&](Options& o) { o.simd = static_cast<Simd>(n); }), "simd");
    EXPECT_EQ(refused([&] { two_triangles()->set_accuracy(0, 1, static_cast<Accuracy>(n)); }), "accuracy");
    EXPECT_EQ(refused([&] { test_vertex_face({}, {.accuracy = static_cast<Accuracy>(n)}, nullptr, nullptr); }),
              "accuracy");
  }
}

TEST(Arguments, NoScene) {
  EXPECT_EQ(refused([] { Detector(nullptr, {}); }), "scene");
}

TEST(Arguments, MeshesThatTheSceneHasNot) {
  const auto scene = two_triangles();
  EXPECT_EQ(refused([&] { scene->ignore_pair(0, 2); }), "mesh_a, mesh_b");
  EXPECT_EQ(refused([&] { scene->set_accuracy(2, 0, Accuracy::fast); }), "mesh_a, mesh_b");
  EXPECT_EQ(refused([&] { scene->set_separation(7, 7, 0.1); }), "mesh_a, mesh_b");
  EXPECT_EQ(refused([&] { scene->set_features(0, 2, {true, false}); }), "mesh_a, mesh_b");
  const std::uint32_t face[3] = {0, 1, 3};
  EXPECT_EQ(refused([&] { scene->add_mesh("a", {}, 3); }), "name");
  EXPECT_EQ(refused([&] { scene->add_mesh("c", face, 3); }),
            "faces[0, 2] is 3, but mesh 'c' has 3 vertices; indices "
            "count this mesh's own vertices from 0");
  EXPECT_EQ(refused([&] { scene->add_mesh("c", std::span(face).first(2), 3); }), "faces");
  EXPECT_EQ(refused([&] { scene->add_mesh("c", {}, 3, {}, face); }), "edges");
  EXPECT_EQ(refused([&] { scene->add_mesh("c", {}, 3, {}, std::span(face).last(2)); }),
            "edges[0, 1] is 3, but mesh 'c' has 3 vertices; indices "
            "count this mesh's own vertices from 0");
  EXPECT_TRUE(scene->edges().empty());
  EXPECT_EQ(scene->meshes().size(), 2u);
}

// Faces and edges from the scene's own lists, which move while they grow.
TEST(Arguments, FeaturesOfTheSceneItself) {
  const auto scene = std::make_shared<Scene>();
  const std::uint32_t face[3] = {0, 1, 2};
  scene->add_mesh("first", face, 3, {}, std::span(face).last(2));
  for (std::uint32_t mesh = 1; mesh < 40; ++mesh)
    scene->add_mesh("again " + std::to_string(mesh), scene->faces()[0], 3, {}, scene->edges()[0]);
  for (std::uint32_t mesh = 0; mesh < 40; ++mesh) {
    EXPECT_EQ(scene->faces()[mesh], (std::array{3 * mesh, 3 * mesh + 1, 3 * mesh + 2}));
    EXPECT_EQ(scene->edges()[mesh], (std::array{3 * mesh + 1, 3 * mesh + 2}));
    EXPECT_EQ(scene->meshes()[mesh].first_edge, mesh);
    EXPECT_EQ(scene->meshes()[mesh].n_edges, 1u);
  }
}

TEST(Arguments, PositionsThatWillNotDo) {
  Detector detector(two_triangles(), {});
  const std::vector<double> start = positions(1), end = positions(-1);
  const std::vector<float> single(18);
  const auto detect = [&](Positions t0, Positions t1) { return refused([&] { detector.detect(t0, t1); }); };
  EXPECT_EQ(detect(Positions::of(start), {}), "vertices_t1");
  EXPECT_EQ(detect({}, Positions::of(end)), "vertices_t0");
  EXPECT_EQ(refused([&] { detector.proximity({}, 1); }), "vertices");
  EXPECT_EQ(refused([&] { detector.intersections({nullptr, 6}); }), "vertices");
  EXPECT_EQ(detect(Positions::of(start), Positions::of(single)), "vertices_t0, vertices_t1");
  EXPECT_EQ(detect(Positions::of(start), {nullptr, 6}), "vertices_t1");
  EXPECT_EQ(detect({nullptr, 6}, Positions::of(end)), "vertices_t0");
  EXPECT_EQ(refused([&] { Positions::of(std::span(start).first(17)); }), "xyz");
  std::vector<double> bad = end;
  bad[4] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(detect(Positions::of(start), Positions::of(bad)).substr(0, 11), "vertices_t1");
  EXPECT_EQ(refused([&] { detector.distances(Positions::of(bad)); }).substr(0, 12), "vertices[1, ");
  EXPECT_EQ(refused([&] { detector.set_separation(0, 2, 1); }), "mesh_a, mesh_b");
  EXPECT_EQ(refused([&] { detector.proximity(Positions::of(start), -1); }), "distance");
  // And all the while:
  EXPECT_EQ(detector.detect(Positions::of(start), Positions::of(end)).vf_toc, (std::vector<double>{0.5, 1, 1}));
}

TEST(Arguments, QueriesThatAreNotFinite) {
  std::vector<Query> queries(3);
  bool hit[3];
  double toc[3];
  for (const double x : {std::nan(""), std::numeric_limits<double>::infinity(), -1e151}) {
    queries[2][23] = x;
    EXPECT_EQ(refused([&] { test_vertex_face(queries, {}, hit, toc); }).substr(0, 16), "queries[2, 7, 2]");
    EXPECT_EQ(refused([&] { test_edge_edge(queries, {}, hit, toc); }).substr(0, 16), "queries[2, 7, 2]");
  }
}

TEST(Arguments, VersionsAgree) { EXPECT_STREQ(version(), HPCCD_VERSION); }

}  // namespace
}  // namespace hpccd
