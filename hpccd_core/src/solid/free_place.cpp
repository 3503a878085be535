// SPDX-License-Identifier: Apache-2.0
#include "solid/free_place.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "elementary/exact/boxes.h"
#include "elementary/exact/intersection.h"
#include "elementary/intersection_filter.h"
#include "solid/winding.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

// Moves the vertices of one mesh and rounds them. Rounding keeps the order along an axis, so a moved box contains what
// is moved.
struct Moved {
  const MovedPair& pair;
  V by;
  V operator()(std::uint32_t vertex) const { return pair.given(vertex) + by; }
  BoxedMesh::Box operator()(const BoxedMesh::Box& box) const {
    const double up = 1 / pair.scale();  // a power of two; coordinates below the smallest normal ones grow
    const V least{0x1p-1022, 0x1p-1022, 0x1p-1022};
    return {up * box.low - least + by, up * box.high + least + by};
  }
};

bool overlap(const BoxedMesh::Box& a, const BoxedMesh::Box& b) {
  return a.low.x <= b.high.x && b.low.x <= a.high.x && a.low.y <= b.high.y && b.low.y <= a.high.y &&
         a.low.z <= b.high.z && b.low.z <= a.high.z;
}

bool edge_meets_face(const V& p, const V& r, const V face[3]) {
  const V q[5] = {p, r, face[0], face[1], face[2]};
  const EdgeFace<double> pair = edge_face(q);
  const Verdict<double> by_volumes = volume_test(pair);
  if (by_volumes.yes || by_volumes.no) return by_volumes.yes;
  return !certainly_apart_in_projection(pair) && exact::intersect(q);
}

bool faces_meet(const V a[3], const V b[3]) {
  const auto box = [](const V f[3]) {
    const auto x = std::minmax({f[0].x, f[1].x, f[2].x}), y = std::minmax({f[0].y, f[1].y, f[2].y}),
               z = std::minmax({f[0].z, f[1].z, f[2].z});
    return BoxedMesh::Box{{x.first, y.first, z.first}, {x.second, y.second, z.second}};
  };
  if (!overlap(box(a), box(b))) return false;
  for (int i = 0; i < 3; ++i)
    if (edge_meets_face(a[i], a[(i + 1) % 3], b) || edge_meets_face(b[i], b[(i + 1) % 3], a)) return true;
  return false;
}

bool surfaces_meet(const MovedPair& pair, const Moved& in_a, const Moved& in_b) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> stack;
  for (const std::uint32_t a : pair.a().roots)
    for (const std::uint32_t b : pair.b().roots) stack.emplace_back(a, b);
  const auto extent = [](const BoxedMesh::Box& box) {
    const V d = box.high - box.low;
    return d.x + d.y + d.z;
  };
  std::uint32_t steps = 0;
  while (!stack.empty()) {
    if (++steps % 256 == 0) pair.heed();
    const auto [n, m] = stack.back();
    stack.pop_back();
    const BoxedMesh::Node &a = pair.a().nodes[n], &b = pair.b().nodes[m];
    if (!overlap(in_a(a.box), in_b(b.box))) continue;
    if (a.children && (!b.children || extent(a.box) >= extent(b.box))) {
      stack.emplace_back(a.children, m), stack.emplace_back(a.children + 1, m);
    } else if (b.children) {
      stack.emplace_back(n, b.children), stack.emplace_back(n, b.children + 1);
    } else {
      for (std::uint32_t i = a.first_face; i < a.end_face; ++i)
        for (std::uint32_t k = b.first_face; k < b.end_face; ++k) {
          const auto &f = pair.a().faces[i], &g = pair.b().faces[k];
          const V x[3] = {in_a(f[0]), in_a(f[1]), in_a(f[2])}, y[3] = {in_b(g[0]), in_b(g[1]), in_b(g[2])};
          if (faces_meet(x, y)) return true;
        }
    }
  }
  return false;
}

// The winding number of a point, as in solid/winding.h, in a moved mesh that does not contain it in its surface.
int winding_in(const BoxedMesh& mesh, const Moved& in_mesh, const V& point) {
  int winding = 0;
  std::vector<std::uint32_t> stack(mesh.roots);
  while (!stack.empty()) {
    const BoxedMesh::Node& node = mesh.nodes[stack.back()];
    stack.pop_back();
    const BoxedMesh::Box box = in_mesh(node.box);
    if (point.x > box.high.x || point.y < box.low.y || point.y > box.high.y || point.z < box.low.z ||
        point.z > box.high.z)
      continue;
    if (node.children) stack.push_back(node.children + 1), stack.push_back(node.children);
    for (std::uint32_t i = node.first_face; i < node.end_face; ++i) {
      const auto& face = mesh.faces[i];
      const V q[4] = {point, in_mesh(face[0]), in_mesh(face[1]), in_mesh(face[2])};
      Crossing c = crossing(q);
      if (!c.certain) c = exact::crossing(q);
      if (c.turn != 0 && c.ahead > 0) winding += c.turn;
    }
  }
  return winding;
}

// The square of the distance of a point from a triangle (Ericson, Real-Time Collision Detection, 5.1.5).
double square_of_distance(const V& p, const V& a, const V& b, const V& c) {
  const auto of_edge = [&](const V& from, const V& to) {
    const V e = to - from, x = p - from;
    const double length = dot(e, e), t = length > 0 ? std::clamp(dot(x, e) / length, 0.0, 1.0) : 0.0;
    const V d = x - t * e;
    return dot(d, d);
  };
  const V ab = b - a, ac = c - a, n = cross(ab, ac), x = p - a;
  const double size = dot(n, n), v = dot(cross(x, ac), n), w = dot(cross(ab, x), n);
  if (size > 0 && v >= 0 && w >= 0 && v + w <= size) {
    const double height = dot(x, n);
    return height * height / size;
  }
  return std::min({of_edge(a, b), of_edge(b, c), of_edge(c, a)});
}

double square_of_distance(const V& p, const BoxedMesh::Box& box) {
  const V d{std::max({box.low.x - p.x, p.x - box.high.x, 0.0}), std::max({box.low.y - p.y, p.y - box.high.y, 0.0}),
            std::max({box.low.z - p.z, p.z - box.high.z, 0.0})};
  return dot(d, d);
}

// In the scale of BoxedMesh.
double distance_from(const MovedPair& pair, const BoxedMesh& mesh, const V& p) {
  double best = INFINITY;
  std::vector<std::pair<double, std::uint32_t>> heap;
  const auto push = [&](std::uint32_t n) {
    const double d = square_of_distance(p, mesh.nodes[n].box);
    if (d < best) heap.emplace_back(-d, n), std::push_heap(heap.begin(), heap.end());
  };
  for (const std::uint32_t n : mesh.roots) push(n);
  while (!heap.empty() && -heap.front().first < best) {
    const BoxedMesh::Node& node = mesh.nodes[heap.front().second];
    std::pop_heap(heap.begin(), heap.end());
    heap.pop_back();
    if (node.children) push(node.children), push(node.children + 1);
    for (std::uint32_t i = node.first_face; i < node.end_face; ++i) {
      const auto& f = mesh.faces[i];
      best = std::min(best, square_of_distance(p, pair.position(f[0]), pair.position(f[1]), pair.position(f[2])));
    }
  }
  return std::sqrt(best);
}

// By branch and bound over the boxes of vertices: the distance from the surface changes no faster than the place.
double deepest_vertex(const MovedPair& pair, const BoxedMesh& inner, const BoxedMesh& outer) {
  if (!outer.topology->closed || outer.roots.empty()) return 0;
  struct Entry {
    double most;
    std::uint32_t node;  // or, beyond all nodes, a vertex
    bool is_vertex;
    bool operator<(const Entry& other) const { return most < other.most; }
  };
  std::vector<Entry> heap;
  const Moved at_rest{pair, {0, 0, 0}};
  const auto overlaps_outer = [&](const BoxedMesh::Box& box) {
    return std::ranges::any_of(outer.roots, [&](std::uint32_t n) { return overlap(box, outer.nodes[n].box); });
  };
  const auto push = [&](double most, std::uint32_t n, bool is_vertex) {
    heap.push_back({most, n, is_vertex}), std::push_heap(heap.begin(), heap.end());
  };
  const auto push_node = [&](std::uint32_t n) {
    const BoxedMesh::Box& box = inner.nodes[n].box;
    if (!overlaps_outer(box)) return;
    const V half = 0.5 * (box.high - box.low), middle = box.low + half;
    const double distance = distance_from(pair, outer, middle), radius = 1.0000001 * std::sqrt(dot(half, half)) + 1e-15;
    // No surface within the radius: all inside or all outside.
    if (distance > radius && winding_in(outer, at_rest, (1 / pair.scale()) * middle) == 0) return;
    push(distance + radius, n, false);
  };
  for (const std::uint32_t n : inner.roots) push_node(n);
  while (!heap.empty()) {
    const Entry top = heap.front();
    std::pop_heap(heap.begin(), heap.end());
    heap.pop_back();
    if (top.is_vertex) {
      // Distances are within 1e-15 of the coordinates, whose largest is below 1, and relatively within 1e-14.
      if (winding_in(outer, at_rest, pair.given(top.node)) != 0) return std::max(0.0, top.most * (1 - 1e-13) - 2e-14);
      continue;
    }
    pair.heed();
    const BoxedMesh::Node& node = inner.nodes[top.node];
    if (node.children) push_node(node.children), push_node(node.children + 1);
    std::vector<std::uint32_t> vertices;
    for (std::uint32_t i = node.first_face; i < node.end_face; ++i)
      vertices.insert(vertices.end(), inner.faces[i].begin(), inner.faces[i].end());
    std::ranges::sort(vertices);
    vertices.erase(std::ranges::unique(vertices).begin(), vertices.end());
    for (const std::uint32_t v : vertices)
      if (overlaps_outer({pair.position(v), pair.position(v)}))
        push(distance_from(pair, outer, pair.position(v)), v, true);
  }
  return 0;
}

}  // namespace

bool is_free(const MovedPair& pair, const V& translation) {
  const Moved in_a{pair, translation}, in_b{pair, {0, 0, 0}};
  if (surfaces_meet(pair, in_a, in_b)) return false;
  const auto inside = [](const BoxedMesh& inner, const Moved& in_inner, const BoxedMesh& outer, const Moved& in_outer) {
    return outer.topology->closed && std::ranges::any_of(inner.topology->representatives, [&](std::uint32_t v) {
             return winding_in(outer, in_outer, in_inner(v)) != 0;
           });
  };
  return !inside(pair.a(), in_a, pair.b(), in_b) && !inside(pair.b(), in_b, pair.a(), in_a);
}

double deepest_vertex(const MovedPair& pair) {
  return std::max(deepest_vertex(pair, pair.a(), pair.b()), deepest_vertex(pair, pair.b(), pair.a())) / pair.scale();
}

}  // namespace hpccd
