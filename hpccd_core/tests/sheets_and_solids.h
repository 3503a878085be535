// SPDX-License-Identifier: Apache-2.0
// Small meshes of every kind, to be combined into scenes.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "grid_scene.h"
#include "hpccd/scene.h"

namespace hpccd::test {

struct Body {
  std::vector<double> positions;
  std::vector<std::uint32_t> faces, edges = {};
  bool points = false;
};

inline Body moved(Body b, std::array<double, 3> by) {
  for (std::size_t i = 0; i < b.positions.size(); ++i) b.positions[i] += by[i % 3];
  return b;
}

// A sheet of side x side vertices, `edge` apart, that waves.
inline Body sheet(std::uint32_t side, double edge) {
  Body b{{}, sheet_faces(side)};
  for (std::uint32_t i = 0; i < side * side; ++i) {
    const double x = edge * (i % side), y = edge * (i / side);
    b.positions.insert(b.positions.end(), {x, y, 0.2 * edge * std::sin(x + 0.7 * y)});
  }
  return b;
}

// A closed sphere: n rings of 2 n vertices between two poles.
inline Body sphere(std::uint32_t n, double radius) {
  Body b;
  const std::uint32_t width = 2 * n, south = n * width, north = south + 1;
  for (std::uint32_t ring = 0; ring < n; ++ring)
    for (std::uint32_t i = 0; i < width; ++i) {
      const double polar = M_PI * (ring + 1) / (n + 1), around = 2 * M_PI * i / width;
      b.positions.insert(b.positions.end(), {radius * std::sin(polar) * std::cos(around),
                                             radius * std::sin(polar) * std::sin(around), -radius * std::cos(polar)});
    }
  b.positions.insert(b.positions.end(), {0, 0, -radius, 0, 0, radius});
  for (std::uint32_t i = 0; i < width; ++i) {
    const std::uint32_t next = (i + 1) % width, last = (n - 1) * width;
    b.faces.insert(b.faces.end(), {south, next, i, north, last + i, last + next});
    for (std::uint32_t ring = 0; ring + 1 < n; ++ring) {
      const std::uint32_t low = ring * width, high = low + width;
      b.faces.insert(b.faces.end(), {low + i, low + next, high + next, low + i, high + next, high + i});
    }
  }
  return b;
}

// n triangles without common vertices.
inline Body soup(std::mt19937& random, std::uint32_t n, double size) {
  std::uniform_real_distribution<double> place(-1, 1);
  Body b;
  for (std::uint32_t i = 0; i < n; ++i) {
    const double center[3] = {place(random), place(random), place(random)};
    for (std::uint32_t corner = 0; corner < 3; ++corner) {
      b.faces.push_back(3 * i + corner);
      for (const double c : center) b.positions.push_back(c + size * place(random));
    }
  }
  return b;
}

inline Body rope(std::mt19937& random, std::uint32_t n) {
  std::uniform_real_distribution<double> turn(-0.2, 0.2);
  Body b;
  double x[3] = {-1, 0.3, 0.2};
  for (std::uint32_t i = 0; i < n; ++i) {
    x[0] += 0.1;
    for (double& c : x) b.positions.push_back(c += turn(random));
    if (i > 0) b.edges.insert(b.edges.end(), {i - 1, i});
  }
  return b;
}

inline Body points(std::mt19937& random, std::uint32_t n) {
  std::uniform_real_distribution<double> place(-1, 1);
  Body b;
  for (std::uint32_t i = 0; i < 3 * n; ++i) b.positions.push_back(place(random));
  b.points = true;
  return b;
}

inline Body with_isolated_vertices(Body b, std::mt19937& random, std::uint32_t n) {
  const Body isolated = points(random, n);
  b.positions.insert(b.positions.end(), isolated.positions.begin(), isolated.positions.end());
  return b;
}

inline Pose random_pose(std::mt19937& random, double reach, bool turned) {
  std::normal_distribution<double> number;
  Pose pose;
  for (double& x : pose.position) x = reach * number(random);
  if (!turned) return pose;
  double square = 0;
  for (double& x : pose.quaternion) x = number(random), square += x * x;
  for (double& x : pose.quaternion) x /= std::sqrt(square);
  return pose;
}

}  // namespace hpccd::test
