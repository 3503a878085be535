// SPDX-License-Identifier: Apache-2.0
#include "translation.h"

#include <algorithm>
#include <cstddef>
#include <set>
#include <utility>

#include "line_in_hull.h"
#include "winding.h"

namespace oracle {
namespace {

struct Side {
  std::vector<Corner> corners;
  const OneMesh& mesh;
};

std::set<std::pair<std::uint32_t, std::uint32_t>> edges_of(const OneMesh& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto& [a, b, c] : mesh.faces) {
    edges.insert(std::minmax(a, b));
    edges.insert(std::minmax(b, c));
    edges.insert(std::minmax(c, a));
  }
  return edges;
}

using Interval = std::pair<Fraction, Fraction>;

// When the edges of one mesh meet the faces of the other: u direction is a point of one minus a point of the other.
void add_intervals(std::vector<Interval>& intervals, const Side& edges, const Side& faces, bool edges_move,
                   const Vec<Integer>& direction) {
  for (const auto& edge : edges_of(edges.mesh))
    for (const Triangle& face : faces.mesh.faces) {
      std::vector<Corner> differences;
      for (const std::uint32_t e : {edge.first, edge.second})
        for (const std::uint32_t f : face)
          differences.push_back(edges_move ? faces.corners[f] - edges.corners[e] : edges.corners[e] - faces.corners[f]);
      if (const auto interval = line_in_hull(differences, direction)) intervals.push_back(*interval);
    }
}

bool any_inside(const Side& inner, const Side& outer, const Integer& scale, const Vec<Integer>& shift) {
  if (!outer.mesh.closed) return false;
  std::vector<Corner> scaled;
  for (const Corner& corner : outer.corners) scaled.push_back(times(scale, corner));
  return std::any_of(inner.corners.begin(), inner.corners.end(), [&](const Corner& corner) {
    return winding_number(scaled, outer.mesh.faces, times(scale, corner) + shift) != 0;
  });
}

// Differences are 32 bits, normals 66, heights 100.
using Wide = __int128;
constexpr unsigned narrow = 30;

template <class T>
std::vector<Vec<T>> converted(const std::vector<Corner>& corners) {
  std::vector<Vec<T>> all;
  for (const Corner& x : corners) all.push_back({static_cast<T>(x[0]), static_cast<T>(x[1]), static_cast<T>(x[2])});
  return all;
}

// Depth in a direction: how far b reaches beyond the beginning of a. The least is at a normal of a face of the
// Minkowski difference: of a face of either, or of an edge of each. Other directions are never below it.
template <class T>
double depth_of_hulls(const Side& side_a, const Side& side_b, int exponent) {
  const auto a = converted<T>(side_a.corners), b = converted<T>(side_b.corners);
  Integer square = -1, over = 1;
  bool apart = false;
  const auto add = [&](const Vec<T>& normal) {
    if (apart || (normal[0] == 0 && normal[1] == 0 && normal[2] == 0)) return;
    T a_low = dot(normal, a[0]), a_high = a_low, b_low = dot(normal, b[0]), b_high = b_low;
    for (const auto& x : a) {
      const T height = dot(normal, x);
      a_low = std::min(a_low, height), a_high = std::max(a_high, height);
    }
    for (const auto& x : b) {
      const T height = dot(normal, x);
      b_low = std::min(b_low, height), b_high = std::max(b_high, height);
    }
    const T width = std::min<T>(b_high - a_low, a_high - b_low);  // of the direction and of its opposite
    apart = width <= 0;
    const Integer w(width), n = dot(Vec<Integer>{Integer(normal[0]), Integer(normal[1]), Integer(normal[2])},
                                    Vec<Integer>{Integer(normal[0]), Integer(normal[1]), Integer(normal[2])});
    if (square < 0 || w * w * over < square * n) square = w * w, over = n;
  };
  const auto add_faces = [&](const OneMesh& mesh, const std::vector<Vec<T>>& x) {
    for (const auto& [i, j, k] : mesh.faces) add(cross(x[j] - x[i], x[k] - x[i]));
  };
  add_faces(side_a.mesh, a);
  add_faces(side_b.mesh, b);
  const auto edges_b = edges_of(side_b.mesh);
  for (const auto& [i, j] : edges_of(side_a.mesh))
    for (const auto& [k, l] : edges_b) add(cross(a[j] - a[i], b[l] - b[k]));
  return apart ? 0.0 : nearest_root(square, over, exponent);
}

}  // namespace

double separating_translation(const OneMesh& mesh_a, const OneMesh& mesh_b, const std::array<double, 3>& direction) {
  const Integers all = coordinates(mesh_a.vertices, mesh_b.vertices);
  const std::size_t n_a = mesh_a.vertices.size(), n_b = mesh_b.vertices.size();
  const Side a{corners_of(all.values, 0, n_a), mesh_a}, b{corners_of(all.values, n_a, n_a + n_b), mesh_b};
  const Vec<Integer> d = corners_of(to_integers({direction.begin(), direction.end()}).values, 0, 1)[0];
  std::vector<Interval> intervals;
  add_intervals(intervals, a, b, true, d);
  add_intervals(intervals, b, a, false, d);
  std::sort(intervals.begin(), intervals.end(), [](const Interval& x, const Interval& y) { return x.first < y.first; });

  Fraction reached{0, 1};  // no s below is free
  const auto is_free = [&](const Fraction& u) {
    const Vec<Integer> shift = times(u.n, d);
    return !any_inside(a, b, u.over, shift) && !any_inside(b, a, u.over, Vec<Integer>{} - shift);
  };
  for (const auto& [start, end] : intervals) {
    if (reached < start) {
      if (is_free({reached.n * start.over + start.n * reached.over, 2 * reached.over * start.over})) break;
      reached = start;
    }
    if (reached < end) reached = end;
  }
  // s = u |d|, and of a direction only the ratios count.
  return nearest_root(reached.n * reached.n * dot(d, d), reached.over * reached.over, all.exponent);
}

double convex_depth(const OneMesh& mesh_a, const OneMesh& mesh_b) {
  const Integers all = coordinates(mesh_a.vertices, mesh_b.vertices);
  const std::size_t n_a = mesh_a.vertices.size(), n_b = mesh_b.vertices.size();
  const Side a{corners_of(all.values, 0, n_a), mesh_a}, b{corners_of(all.values, n_a, n_a + n_b), mesh_b};
  const bool fits = std::all_of(all.values.begin(), all.values.end(),
                                [](const Integer& x) { return abs(x) < (Integer(1) << narrow); });
  return fits ? depth_of_hulls<Wide>(a, b, all.exponent) : depth_of_hulls<Integer>(a, b, all.exponent);
}

}  // namespace oracle
