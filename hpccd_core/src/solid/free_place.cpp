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

double square_of_distance(const V& p, const BoxedMesh::Box& box) {
  const V d{std::max({box.low.x - p.x, p.x - box.high.x, 0.0}), std::max({box.low.y - p.y, p.y - box.high.y, 0.0}),
            std::max({box.low.z - p.z, p.z - box.high.z, 0.0})};
  return dot(d, d);
}

// A point of a surface, and its distance from another point.
struct NearPoint {
  V at;
  double distance;
};

// The point of a triangle that is nearest to p (Ericson, Real-Time Collision Detection, 5.1.5).
V nearest_point(const V& p, const V& a, const V& b, const V& c) {
  const V ab = b - a, ac = c - a, n = cross(ab, ac), x = p - a;
  const double size = dot(n, n), v = dot(cross(x, ac), n), w = dot(cross(ab, x), n);
  if (size > 0 && v >= 0 && w >= 0 && v + w <= size) return p - (dot(x, n) / size) * n;
  V best = a;
  double least = INFINITY;
  const auto try_edge = [&](const V& from, const V& to) {
    const V e = to - from;
    const double length = dot(e, e), t = length > 0 ? std::clamp(dot(p - from, e) / length, 0.0, 1.0) : 0.0;
    const V at = from + t * e, d = p - at;
    if (const double square = dot(d, d); square < least) least = square, best = at;
  };
  try_edge(a, b), try_edge(b, c), try_edge(c, a);
  return best;
}

// The vertex of one mesh that is deepest inside another one, by branch and bound over the boxes of vertices: a point q
// of the outer surface bounds the depth of all that is in a box by the distance of its farthest corner from q. Patches
// around the deepest vertex are nearly perpendicular to the way to the surface, so this bound is much closer than the
// distance of the middle plus the radius. All in the scale of BoxedMesh.
class DeepestVertex {
 public:
  DeepestVertex(const MovedPair& pair, const BoxedMesh& inner, const BoxedMesh& outer)
      : pair_(pair), inner_(inner), outer_(outer) {}

  // If it is deeper than `best`; otherwise `best`.
  double search(double best) {
    best_ = best;
    if (!outer_.topology->closed || outer_.roots.empty()) return best_;
    for (const std::uint32_t n : inner_.roots) push(n, {INFINITY, n, {}, false});
    std::uint32_t steps = 0;
    while (!heap_.empty() && heap_.front().most > best_) {
      if (++steps % 64 == 0) pair_.heed();
      const Entry top = heap_.front();
      std::pop_heap(heap_.begin(), heap_.end());
      heap_.pop_back();
      const BoxedMesh::Node& node = inner_.nodes[top.node];
      if (node.children) push(node.children, top), push(node.children + 1, top);
      for (std::uint32_t i = node.first_face; i < node.end_face; ++i)
        for (const std::uint32_t v : inner_.faces[i]) consider(v, top);
    }
    return best_;
  }

 private:
  struct Entry {
    double most;  // depth
    std::uint32_t node;
    V near;  // a point of the outer surface
    bool all_inside;
    bool operator<(const Entry& other) const { return most < other.most; }
  };

  bool overlaps_outer(const BoxedMesh::Box& box) const {
    return std::ranges::any_of(outer_.roots, [&](std::uint32_t n) { return overlap(box, outer_.nodes[n].box); });
  }
  bool inside(const V& given) const { return winding_in(outer_, {pair_, {0, 0, 0}}, given) != 0; }

  void consider(std::uint32_t vertex, const Entry& of) {
    const V x = pair_.position(vertex);
    if (!overlaps_outer({x, x}) || length(x - of.near) <= best_) return;
    const double distance = nearest(x, {of.near, length(x - of.near)}, 0, best_).distance;
    if (distance > best_ && (of.all_inside || inside(pair_.given(vertex)))) best_ = distance;
  }

  void push(std::uint32_t n, const Entry& parent) {
    const BoxedMesh::Box& box = inner_.nodes[n].box;
    if (!overlaps_outer(box)) return;
    const auto most_from = [&](const V& q) {
      const auto most = [](double low, double high, double at) { return std::max(high - at, at - low); };
      return length(
          {most(box.low.x, box.high.x, q.x), most(box.low.y, box.high.y, q.y), most(box.low.z, box.high.z, q.z)});
    };
    const bool first = parent.most == INFINITY;
    Entry entry{first ? parent.most : std::min(parent.most, most_from(parent.near)), n, parent.near, parent.all_inside};
    if (entry.most <= best_) return;
    const V half = 0.5 * (box.high - box.low), middle = box.low + half;
    const double radius = 1.0000001 * length(half) + 1e-15, slack = 0.25 * radius;
    const NearPoint q = nearest(
        middle, first ? NearPoint{{}, INFINITY} : NearPoint{parent.near, length(middle - parent.near)}, slack, 0);
    entry.near = q.at, entry.most = std::min(entry.most, most_from(q.at));
    if (entry.most <= best_) return;
    // No surface within the radius: all inside or all outside.
    if (!entry.all_inside && q.distance - slack > radius) {
      if (!inside((1 / pair_.scale()) * middle)) return;
      entry.all_inside = true;
    }
    heap_.push_back(entry), std::push_heap(heap_.begin(), heap_.end());
  }

  // A point of the outer surface that is at most `slack` farther than the nearest one, or nearer than `enough`. best: a
  // point to begin with, if any.
  NearPoint nearest(const V& p, NearPoint best, double slack, double enough) {
    double limit = 0, square = best.distance * best.distance;
    const auto set_limit = [&] {
      const double d = best.distance - slack;
      limit = d > 0 ? d * d : 0;
    };
    set_limit();
    stack_.clear();
    const auto visit = [&](std::uint32_t n) {
      if (const double d = square_of_distance(p, outer_.nodes[n].box); d < limit) stack_.emplace_back(d, n);
    };
    for (const std::uint32_t n : outer_.roots) visit(n);
    while (!stack_.empty()) {
      const auto [gap, n] = stack_.back();
      stack_.pop_back();
      if (gap >= limit) continue;
      const BoxedMesh::Node& node = outer_.nodes[n];
      if (node.children) {
        double x = square_of_distance(p, outer_.nodes[node.children].box);
        double y = square_of_distance(p, outer_.nodes[node.children + 1].box);
        const bool swap = x < y;
        if (std::max(x, y) < limit) stack_.emplace_back(std::max(x, y), node.children + swap);
        if (std::min(x, y) < limit) stack_.emplace_back(std::min(x, y), node.children + !swap);
        continue;
      }
      for (std::uint32_t i = node.first_face; i < node.end_face; ++i) {
        const auto& f = outer_.faces[i];
        const V q = nearest_point(p, pair_.position(f[0]), pair_.position(f[1]), pair_.position(f[2])), d = p - q;
        if (const double s = dot(d, d); s < square) square = s, best = {q, std::sqrt(s)}, set_limit();
      }
      if (best.distance <= enough) break;
    }
    return best;
  }

  static double length(const V& x) { return std::sqrt(dot(x, x)); }

  const MovedPair& pair_;
  const BoxedMesh &inner_, &outer_;
  double best_ = 0;
  std::vector<Entry> heap_;
  std::vector<std::pair<double, std::uint32_t>> stack_;
};

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
  const double in_b = DeepestVertex(pair, pair.a(), pair.b()).search(0);
  const double depth = DeepestVertex(pair, pair.b(), pair.a()).search(in_b);
  // Distances are within 1e-15 of the coordinates, whose largest is below 1, and relatively within 1e-14.
  return std::max(0.0, depth * (1 - 1e-13) - 2e-14) / pair.scale();
}

}  // namespace hpccd
