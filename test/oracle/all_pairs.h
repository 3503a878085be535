// SPDX-License-Identifier: Apache-2.0
// Every pair of features that a scene asks for.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "parallel.h"

namespace oracle {

using Point = std::array<double, 3>;
using Vertex = std::array<std::uint32_t, 1>;
using Edge = std::array<std::uint32_t, 2>;
using Face = std::array<std::uint32_t, 3>;

struct Meshes {
  std::vector<Face> faces;                        // scene-wide vertex indices
  std::vector<Edge> edges;                        // those beside the faces' own, likewise
  std::vector<std::uint32_t> mesh_of_vertex;      // all vertices of a face lie in one mesh
  std::vector<std::vector<std::uint8_t>> tested;  // tested[a][b]: pairs of meshes a and b are asked for

  std::uint32_t mesh_of(std::uint32_t vertex) const { return mesh_of_vertex[vertex]; }
};

// Every vertex, in a face or not.
std::vector<Vertex> vertices_of(const Meshes& meshes);

// The edges of all faces and those beside, each once, lower index first, in lexicographic order; one from a vertex to
// itself is none.
std::vector<Edge> edges_of(const Meshes& meshes);

// Box of a feature's vertices at both ends of the step. A vertex on a straight line stays in the box of its
// two ends and a feature in the box of its vertices; minima and maxima do not round.
struct Box {
  Point low, high;
};

// Whether the boxes prove that features are farther apart than this.
bool farther_apart(const Box& a, const Box& b, double distance);

// Features of one kind; the pairs' order is theirs.
template <class Feature>
struct Features {
  std::vector<Feature> list;
  std::vector<Box> boxes;
};

template <class Feature>
Features<Feature> with_boxes(std::vector<Feature> list, const std::vector<Point>& t0, const std::vector<Point>& t1) {
  Features<Feature> features{std::move(list), {}};
  for (const Feature& feature : features.list) {
    Box box{t0[feature[0]], t0[feature[0]]};
    for (const std::uint32_t v : feature)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        box.low[axis] = std::min({box.low[axis], t0[v][axis], t1[v][axis]});
        box.high[axis] = std::max({box.high[axis], t0[v][axis], t1[v][axis]});
      }
    features.boxes.push_back(box);
  }
  return features;
}

template <class A, class B>
bool share_a_vertex(const A& a, const B& b) {
  return std::any_of(a.begin(), a.end(), [&](auto v) { return std::find(b.begin(), b.end(), v) != b.end(); });
}

struct Found {
  std::size_t first, second;  // places in the lists
  double value;
};

// What test(a, b) returns for each a of the first list and b of the second (of one and the same list: behind a),
// where it returns a value. Not asked: pairs that share a vertex, whose meshes are not tested, or whose boxes are
// farther apart than reach(mesh of a, mesh of b). In lexicographic order of places.
template <class A, class B, class Reach, class Test>
std::vector<Found> all_pairs(const Meshes& meshes, const Features<A>& first, const Features<B>& second,
                             const Reach& reach, unsigned threads, const Test& test) {
  const bool one_list = static_cast<const void*>(&first) == static_cast<const void*>(&second);
  std::vector<std::vector<Found>> of_each(first.list.size());
  parallel_for(first.list.size(), threads, [&](std::size_t i) {
    for (std::size_t j = one_list ? i + 1 : 0; j < second.list.size(); ++j) {
      const A& a = first.list[i];
      const B& b = second.list[j];
      const std::uint32_t mesh_a = meshes.mesh_of(a[0]), mesh_b = meshes.mesh_of(b[0]);
      if (!meshes.tested[mesh_a][mesh_b] || farther_apart(first.boxes[i], second.boxes[j], reach(mesh_a, mesh_b)) ||
          share_a_vertex(a, b))
        continue;
      if (const std::optional<double> value = test(a, b)) of_each[i].push_back({i, j, *value});
    }
  });
  std::vector<Found> found;
  for (const auto& of_one : of_each) found.insert(found.end(), of_one.begin(), of_one.end());
  return found;
}

}  // namespace oracle
