// SPDX-License-Identifier: Apache-2.0
// Points, normals, nearest points and weights of contacts: with a separation between the features, without one where
// they meet.
#include "contacts/places.h"

#include <gtest/gtest.h>

#include <random>

namespace hpccd {
namespace {

using V = Vec3<double>;

V at(const std::array<double, 3>& x) { return {x[0], x[1], x[2]}; }

Contacts detect(const std::vector<V>& t0, const std::vector<V>& t1, std::vector<std::uint32_t> faces, double separation,
                bool points = true, bool normals = true, bool closest = true, bool weights = true) {
  auto scene = std::make_shared<Scene>();
  scene->add_mesh("pair", faces, static_cast<std::uint32_t>(t0.size()), {});
  Options options;
  options.backend = Backend::cpu, options.threads = 1, options.minimum_separation = separation;
  options.points = points, options.normals = normals, options.closest = closest;
  options.weights = weights;
  return Detector(scene, options).detect({t0.data(), t0.size()}, {t1.data(), t1.size()});
}

const std::vector<V> above = {{0.25, 0.25, 4}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
const std::vector<V> below = {{0.25, 0.25, -4}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
const std::vector<V> lower = {{0.25, 0.25, 1}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};

TEST(Places, OfAVertexThatComesNearAreBetweenItAndTheFace) {
  for (const bool from_below : {false, true}) {
    const Contacts c = from_below ? detect(below, above, {1, 2, 3}, 1) : detect(above, below, {1, 2, 3}, 1);
    const double side = from_below ? -1 : 1;
    ASSERT_EQ(c.vf_toc.size(), 1u);
    EXPECT_NEAR(c.vf_toc[0], 0.375, 1e-12);
    EXPECT_LE(max_norm(at(c.points[0]) - V{0.25, 0.25, 0.5 * side}), 1e-11);
    EXPECT_LE(max_norm(at(c.normals[0]) - V{0, 0, side}), 1e-11) << "from the face to the vertex";
    EXPECT_LE(max_norm(at(c.closest[0][0]) - V{0.25, 0.25, side}), 1e-11) << "the vertex first";
    EXPECT_LE(max_norm(at(c.closest[0][1]) - V{0.25, 0.25, 0}), 1e-11);
  }
}

TEST(Places, OfEdgesLeadFromTheFirstToTheSecond) {
  const std::vector<V> apart = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 5}, {0, 1, 5}},
                       near = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 1}, {0, 1, 1}};
  const Contacts c = detect(apart, near, {0, 1, 1, 2, 3, 3}, 2);
  ASSERT_EQ(c.ee_toc.size(), 1u);
  const std::size_t i = c.vf.size();  // vertices and the faces that are edges come first
  EXPECT_NEAR(c.ee_toc[0], 0.75, 1e-12);
  EXPECT_LE(max_norm(at(c.points[i]) - V{0, 0, 1}), 1e-11);
  EXPECT_LE(max_norm(at(c.normals[i]) - V{0, 0, 1}), 1e-11);
  EXPECT_LE(max_norm(at(c.closest[i][0]) - V{0, 0, 0}), 1e-11);
  EXPECT_LE(max_norm(at(c.closest[i][1]) - V{0, 0, 2}), 1e-11);
}

TEST(Places, AtNoDistanceAreThoseOfPlainContact) {
  // In the face already at the start: there is no direction between the nearest points.
  std::vector<V> touching = above;
  touching[0].z = 0;
  const Contacts separated = detect(touching, below, {1, 2, 3}, 1), plain = detect(touching, below, {1, 2, 3}, 0);
  ASSERT_EQ(separated.vf_toc, std::vector<double>{0});
  EXPECT_EQ(separated.points, plain.points);
  EXPECT_EQ(separated.normals, plain.normals);
  EXPECT_EQ(at(separated.normals[0]).z, 1) << "where the motion would have come from";
}

TEST(Places, OnlyWhatIsAskedForIsThere) {
  const Contacts every = detect(above, lower, {1, 2, 3}, 2);
  ASSERT_EQ(every.vf.size(), 1u);
  for (int asked = 0; asked < 16; ++asked) {
    const bool points = asked & 1, normals = asked & 2, closest = asked & 4, weights = asked & 8;
    const Contacts c = detect(above, lower, {1, 2, 3}, 2, points, normals, closest, weights);
    EXPECT_EQ(c.hash, every.hash);
    EXPECT_EQ(c.points, points ? every.points : decltype(c.points){});
    EXPECT_EQ(c.normals, normals ? every.normals : decltype(c.normals){});
    EXPECT_EQ(c.closest, closest ? every.closest : decltype(c.closest){});
    EXPECT_EQ(c.vertices, weights ? every.vertices : decltype(c.vertices){});
    EXPECT_EQ(c.weights, weights ? every.weights : decltype(c.weights){});
    EXPECT_EQ(c.approach, weights ? every.approach : decltype(c.approach){});
  }
}

}  // namespace
}  // namespace hpccd
