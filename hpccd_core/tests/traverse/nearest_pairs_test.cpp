// SPDX-License-Identifier: Apache-2.0
// Branch and bound for smallest distances: the nearest of all pairs as integers see them, the first of those that are
// equally near, with any number of threads.
#include "traverse/nearest_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "elementary/exact/distance.h"
#include "elementary/exact/intersection.h"
#include "scene/features.h"
#include "swarm_scene.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

struct OnePair {
  double distance = INFINITY;
  GapKind kind = GapKind::none;
  std::array<std::uint32_t, 4> features{};
};

// All pairs of features of two meshes, one by one.
struct OneByOne {
  const Scene& scene;
  const std::vector<double>& positions;
  Features features = features_of(scene);

  std::size_t mesh_of(std::uint32_t v) const {
    std::size_t mesh = 0;
    while (v >= scene.meshes()[mesh].first_vertex + scene.meshes()[mesh].n_vertices) ++mesh;
    return mesh;
  }
  V at(std::uint32_t v) const { return {positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]}; }

  // In canonical order, those that intersect first; so the first of the nearest wins.
  OnePair nearest(std::size_t mesh_a, std::size_t mesh_b) const {
    const auto between = [&](std::uint32_t v, std::uint32_t w) {
      return std::minmax(mesh_of(v), mesh_of(w)) == std::minmax(mesh_a, mesh_b);
    };
    const auto n_faces = static_cast<std::uint32_t>(features.faces.size());
    for (const auto& e : features.edges)
      for (std::uint32_t j = 0; j < n_faces; ++j) {
        const auto& f = features.faces[j];
        if (!between(e[0], f[0]) || std::ranges::find_first_of(e, f) != e.end()) continue;
        const V q[5] = {at(e[0]), at(e[1]), at(f[0]), at(f[1]), at(f[2])};
        if (exact::intersect(q)) return {0, GapKind::edge_face, {e[0], e[1], j}};
      }
    OnePair best;
    const auto keep = [&](double distance, GapKind kind, std::array<std::uint32_t, 4> names) {
      if (distance < best.distance) best = {distance, kind, names};
    };
    for (std::uint32_t v = 0; v < scene.n_vertices(); ++v)
      for (std::uint32_t j = 0; j < n_faces; ++j) {
        const auto& f = features.faces[j];
        if (!between(v, f[0]) || std::ranges::find(f, v) != f.end()) continue;
        const V q[4] = {at(v), at(f[0]), at(f[1]), at(f[2])};
        keep(exact::distance(Kind::vertex_face, q), GapKind::vertex_face, {v, j});
      }
    for (std::size_t i = 0; i < features.edges.size(); ++i)
      for (std::size_t j = i + 1; j < features.edges.size(); ++j) {
        const auto &a = features.edges[i], &b = features.edges[j];
        if (!between(a[0], b[0]) || std::ranges::find_first_of(a, b) != a.end()) continue;
        const V q[4] = {at(a[0]), at(a[1]), at(b[0]), at(b[1])};
        keep(exact::distance(Kind::edge_edge, q), GapKind::edge_edge, {a[0], a[1], b[0], b[1]});
      }
    return best;
  }

  // Distance of the features that a gap names, by integers.
  double distance_of(const Gap& gap) const {
    const auto& v = gap.features;
    if (gap.kind == GapKind::edge_edge) {
      const V q[4] = {at(v[0]), at(v[1]), at(v[2]), at(v[3])};
      return exact::distance(Kind::edge_edge, q);
    }
    const auto& f = features.faces[v[gap.kind == GapKind::vertex_face ? 1 : 2]];
    if (gap.kind == GapKind::vertex_face) {
      const V q[4] = {at(v[0]), at(f[0]), at(f[1]), at(f[2])};
      return exact::distance(Kind::vertex_face, q);
    }
    const V q[5] = {at(v[0]), at(v[1]), at(f[0]), at(f[1]), at(f[2])};
    return exact::intersect(q) ? 0 : INFINITY;
  }
};

std::vector<Gap> distances(const std::shared_ptr<const Scene>& scene, const std::vector<double>& positions,
                           int threads) {
  Options options;
  options.backend = Backend::cpu, options.threads = threads;
  return Detector(scene, options).distances({positions.data(), positions.size() / 3});
}

// `exactly`: distances of pairs are exact in doubles, so that those equally near can be told to be. Else, where two
// vertices are nearest, rounding tells the pairs apart that they are in.
void expect_nearest(const std::shared_ptr<const Scene>& scene, const std::vector<double>& positions, bool exactly) {
  const OneByOne oracle{*scene, positions};
  double size = 1;
  for (const double x : positions) size = std::max(size, std::fabs(x));
  std::vector<std::pair<std::uint32_t, std::uint32_t>> enabled;
  for (std::uint32_t a = 0; a < scene->meshes().size(); ++a)
    for (std::uint32_t b = a; b < scene->meshes().size(); ++b)
      if (scene->pair_enabled(a, b)) enabled.push_back({a, b});
  for (const int threads : {1, 2, 5}) {
    const std::vector<Gap> gaps = distances(scene, positions, threads);
    ASSERT_EQ(gaps.size(), enabled.size());
    for (std::size_t i = 0; i < gaps.size(); ++i) {
      const Gap& gap = gaps[i];
      ASSERT_EQ(std::pair(gap.mesh_a, gap.mesh_b), enabled[i]);
      const OnePair expected = oracle.nearest(gap.mesh_a, gap.mesh_b);
      if (expected.kind == GapKind::none) {
        EXPECT_EQ(gap.distance, INFINITY);
        EXPECT_EQ(gap.kind, GapKind::none);
        continue;
      }
      EXPECT_NEAR(oracle.distance_of(gap), expected.distance, 1e-12 * size) << "of the features named";
      EXPECT_NEAR(gap.distance, expected.distance, 1e-12 * size) << gap.mesh_a << " and " << gap.mesh_b;
      EXPECT_EQ(gap.kind == GapKind::edge_face, expected.kind == GapKind::edge_face);
      if (exactly || expected.kind == GapKind::edge_face) {
        EXPECT_EQ(gap.kind, expected.kind);
        EXPECT_EQ(gap.features, expected.features) << gap.mesh_a << " and " << gap.mesh_b << ", threads " << threads;
      }
    }
  }
}

std::shared_ptr<Scene> triangles(std::uint32_t n_meshes, std::uint32_t per_mesh, bool lone) {
  auto scene = std::make_shared<Scene>();
  std::vector<std::uint32_t> faces(3 * per_mesh);
  for (std::uint32_t i = 0; i < faces.size(); ++i) faces[i] = i;
  for (std::uint32_t m = 0; m < n_meshes; ++m)
    scene->add_mesh("mesh" + std::to_string(m), faces, 3 * per_mesh + lone, {});
  return scene;
}

TEST(NearestPairs, OfBodiesApartAndThroughEachOther) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> real(-1, 1);
  for (const double apart : {0.3, 1.0, 4.0}) {
    const auto scene = triangles(4, 5, true);
    std::vector<double> positions;
    for (std::uint32_t v = 0; v < scene->n_vertices(); ++v)
      for (int axis = 0; axis < 3; ++axis) positions.push_back(real(random) + (axis == 0 ? apart * (v / 16) : 0));
    expect_nearest(scene, positions, false);
  }
}

// Where all boxes are within the smallest distance along each axis.
TEST(NearestPairs, OfBodiesFarApart) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> real(-1, 1);
  for (const double apart : {3.0, 20.0, 1e4}) {
    const auto scene = triangles(4, 12, true);
    const std::uint32_t per_mesh = scene->n_vertices() / 4;
    std::vector<double> positions;
    for (std::uint32_t v = 0; v < scene->n_vertices(); ++v)
      for (const double along : {1.0, -0.9, 0.8})
        positions.push_back(real(random) + apart * along * std::array{0, 1, -1, 3}[v / per_mesh]);
    expect_nearest(scene, positions, false);
  }
}

TEST(NearestPairs, TheFirstOfThoseThatAreEquallyNear) {
  // Unit squares above each other: distances of all pairs of features that are 2 apart are exact in doubles.
  for (const double height : {2.0, 0.5, 16.0}) {
    auto scene = std::make_shared<Scene>();
    std::vector<double> positions;
    constexpr std::uint32_t side = 4;
    std::vector<std::uint32_t> faces;
    for (std::uint32_t row = 0; row + 1 < side; ++row)
      for (std::uint32_t column = 0; column + 1 < side; ++column) {
        const std::uint32_t a = row * side + column;
        faces.insert(faces.end(), {a, a + 1, a + side, a + 1, a + side + 1, a + side});
      }
    for (std::uint32_t sheet = 0; sheet < 3; ++sheet) {
      scene->add_mesh("sheet" + std::to_string(sheet), faces, side * side, {.self_collision = false});
      for (std::uint32_t i = 0; i < side * side; ++i)
        positions.insert(positions.end(), {double(i % side), double(i / side), sheet * height});
    }
    expect_nearest(scene, positions, true);
  }
}

TEST(NearestPairs, OnALatticeWhereMuchTouches) {
  std::mt19937 random(4);
  for (int turn = 0; turn < 10; ++turn) {
    const auto scene = triangles(3, 4, turn % 2);
    std::vector<double> positions;
    for (std::uint32_t i = 0; i < 3 * scene->n_vertices(); ++i)
      positions.push_back(static_cast<int>(random() % 9) - 4 + (i % 3 == 0 ? 3.0 * (i / 36) : 0));
    expect_nearest(scene, positions, false);
  }
}

TEST(NearestPairs, OfManyPiecesUnderAllRules) {
  const auto scene = test::swarm_scene(true);
  const auto positions = test::swarm_positions(1);
  const std::vector<Gap> one = distances(scene, positions, 1);
  for (const int threads : {2, 7}) {
    const std::vector<Gap> other = distances(scene, positions, threads);
    ASSERT_EQ(other.size(), one.size());
    for (std::size_t i = 0; i < one.size(); ++i) {
      EXPECT_EQ(other[i].distance, one[i].distance);
      EXPECT_EQ(other[i].features, one[i].features);
      EXPECT_EQ(other[i].points, one[i].points);
    }
  }
}

}  // namespace
}  // namespace hpccd
