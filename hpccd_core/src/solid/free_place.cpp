// SPDX-License-Identifier: Apache-2.0
#include "solid/free_place.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
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

// use(face of a, face of b) for the faces in leaves whose boxes overlap, by numbers in BoxedMesh, until it returns
// true.
template <class Use>
bool any_near(const MovedPair& pair, const Moved& in_a, const Moved& in_b, Use&& use) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> stack{{0, 0}};
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
        for (std::uint32_t k = b.first_face; k < b.end_face; ++k)
          if (use(i, k)) return true;
    }
  }
  return false;
}

void corners(const BoxedMesh& mesh, std::uint32_t face, const Moved& moved, V (&corner)[3]) {
  for (std::size_t i = 0; i < 3; ++i) corner[i] = moved(mesh.faces[face][i]);
}

bool surfaces_meet(const MovedPair& pair, const Moved& in_a, const Moved& in_b) {
  return any_near(pair, in_a, in_b, [&](std::uint32_t i, std::uint32_t k) {
    V x[3], y[3];
    corners(pair.a(), i, in_a, x), corners(pair.b(), k, in_b, y);
    return faces_meet(x, y);
  });
}

// The winding number of a point, as in solid/winding.h, in a moved mesh that does not contain it in its surface.
int winding_in(const BoxedMesh& mesh, const Moved& in_mesh, const V& point) {
  int winding = 0;
  std::vector<std::uint32_t> stack{0};
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

// The vertex of either mesh that is deepest inside the other one, if that is closed, by branch and bound over the boxes
// of vertices: a point q of the outer surface bounds the depth of all that is in a box by the distance of its farthest
// corner from q. Patches around the deepest vertex are nearly perpendicular to the way to the surface, so this bound is
// much closer than the distance of the middle plus the radius. All in the scale of BoxedMesh.
class DeepestVertexSearch {
 public:
  explicit DeepestVertexSearch(const MovedPair& pair) : pair_(pair) {}

  DeepestVertex search() {
    // A few vertices at first: the deeper the best one, the fewer boxes remain.
    for (const bool of_a : {true, false}) {
      const BoxedMesh& mesh = inner(of_a);
      constexpr std::size_t n_samples = 64;
      const std::size_t every = mesh.faces.size() / n_samples + 1;
      for (std::size_t i = every / 2; contains(of_a) && i < mesh.faces.size(); i += every)
        consider(mesh.faces[i][0], {INFINITY, 0, of_a, false, false, {}});
    }
    for (const bool of_a : {true, false})
      if (contains(of_a)) push(0, {INFINITY, 0, of_a, false, false, {}});
    std::uint32_t steps = 0;
    while (!heap_.empty() && heap_.front().most > best_) {
      if (++steps % 64 == 0) pair_.heed();
      Entry top = heap_.front();
      std::pop_heap(heap_.begin(), heap_.end());
      heap_.pop_back();
      if (!top.has_own_near) {
        if (find_near(top)) put(top);
        continue;
      }
      const BoxedMesh& mesh = inner(top.of_a);
      const BoxedMesh::Node& node = mesh.nodes[top.node];
      top.has_own_near = false;
      if (node.children) push(node.children, top), push(node.children + 1, top);
      for (std::uint32_t i = node.first_face; i < node.end_face; ++i)
        for (const std::uint32_t v : mesh.faces[i]) consider(v, top);
    }
    // Distances are within 1e-15 of the coordinates, whose largest is below 1, and relatively within 1e-14.
    return {std::max(0.0, best_ * (1 - 1e-13) - 2e-14) / pair_.scale(), way_out_};
  }

 private:
  struct Entry {
    double most;  // depth; infinite before anything is known
    std::uint32_t node;
    bool of_a, all_inside;
    bool has_own_near;  // or else that of its parent
    V near;             // a point of the outer surface
    bool operator<(const Entry& other) const { return most < other.most; }
  };

  const BoxedMesh& inner(bool a) const { return a ? pair_.a() : pair_.b(); }
  const BoxedMesh& outer(bool of_a) const { return inner(!of_a); }
  bool contains(bool of_a) const { return outer(of_a).topology->closed; }
  bool overlaps_outer(const BoxedMesh::Box& box, bool of_a) const {
    const BoxedMesh& mesh = outer(of_a);
    return overlap(box, mesh.nodes[0].box);
  }
  bool inside(const V& given, bool of_a) const { return winding_in(outer(of_a), {pair_, {0, 0, 0}}, given) != 0; }
  static NearPoint known(const V& p, const Entry& of) {
    return of.most == INFINITY ? NearPoint{{}, INFINITY} : NearPoint{of.near, length(p - of.near)};
  }

  void consider(std::uint32_t vertex, const Entry& of) {
    const V x = pair_.position(vertex);
    const NearPoint first = known(x, of);
    if (first.distance <= best_ || !overlaps_outer({x, x}, of.of_a)) return;
    const NearPoint q = nearest(outer(of.of_a), x, first, 0, best_);
    if (!(q.distance > best_) || !(of.all_inside || inside(pair_.given(vertex), of.of_a))) return;
    best_ = q.distance;
    way_out_ = of.of_a ? q.at - x : x - q.at;
  }

  void put(const Entry& entry) { heap_.push_back(entry), std::push_heap(heap_.begin(), heap_.end()); }

  void push(std::uint32_t n, const Entry& parent) {
    if (!overlaps_outer(inner(parent.of_a).nodes[n].box, parent.of_a)) return;
    Entry entry = parent;
    entry.node = n;
    if (parent.most < INFINITY) entry.most = std::min(parent.most, farthest(entry));
    if (entry.most > best_) put(entry);
  }

  // From the point `near`, of all that is in the node.
  double farthest(const Entry& of) const {
    const BoxedMesh& mesh = inner(of.of_a);
    const BoxedMesh::Node& node = mesh.nodes[of.node];
    const auto most = [](double low, double high, double at) { return std::max(high - at, at - low); };
    const V corner{most(node.box.low.x, node.box.high.x, of.near.x), most(node.box.low.y, node.box.high.y, of.near.y),
                   most(node.box.low.z, node.box.high.z, of.near.z)};
    double square = dot(corner, corner);
    if (!node.children && square > best_ * best_) {
      square = 0;
      for (std::uint32_t i = node.first_face; i < node.end_face; ++i)
        for (const std::uint32_t v : mesh.faces[i]) {
          const V d = pair_.position(v) - of.near;
          square = std::max(square, dot(d, d));
        }
    }
    return std::sqrt(square);
  }

  // Whether anything in the node may be inside and deeper than the best.
  bool find_near(Entry& entry) {
    const BoxedMesh::Box& box = inner(entry.of_a).nodes[entry.node].box;
    const V half = 0.5 * (box.high - box.low), middle = box.low + half;
    const double radius = 1.0000001 * length(half) + 1e-15, slack = 0.25 * radius;
    // Nearer than best - radius, nothing in the box is deeper than the best.
    const NearPoint q = nearest(outer(entry.of_a), middle, known(middle, entry), slack, best_ - radius);
    if (q.distance <= best_ - radius) return false;
    entry.near = q.at, entry.most = std::min(entry.most, farthest(entry)), entry.has_own_near = true;
    if (entry.most <= best_) return false;
    // No surface within the radius: all inside or all outside.
    if (!entry.all_inside && q.distance - slack > radius) {
      if (!inside((1 / pair_.scale()) * middle, entry.of_a)) return false;
      entry.all_inside = true;
    }
    return true;
  }

  // A point of a surface that is at most `slack` farther than the nearest one, or nearer than `enough`. best: a
  // point to begin with, if any.
  NearPoint nearest(const BoxedMesh& mesh, const V& p, NearPoint best, double slack, double enough) {
    double limit = 0, square = best.distance * best.distance;
    const auto set_limit = [&] {
      const double d = best.distance - slack;
      limit = d > 0 ? d * d : 0;
    };
    set_limit();
    stack_.clear();
    const auto visit = [&](std::uint32_t n) {
      if (const double d = square_of_distance(p, mesh.nodes[n].box); d < limit) stack_.emplace_back(d, n);
    };
    visit(0);
    while (!stack_.empty()) {
      const auto [gap, n] = stack_.back();
      stack_.pop_back();
      if (gap >= limit) continue;
      const BoxedMesh::Node& node = mesh.nodes[n];
      if (node.children) {
        double x = square_of_distance(p, mesh.nodes[node.children].box);
        double y = square_of_distance(p, mesh.nodes[node.children + 1].box);
        const bool swap = x < y;
        if (std::max(x, y) < limit) stack_.emplace_back(std::max(x, y), node.children + swap);
        if (std::min(x, y) < limit) stack_.emplace_back(std::min(x, y), node.children + !swap);
        continue;
      }
      // A face is not nearer than its corners are along any direction; that towards the leaf excludes most faces.
      const V to = 0.5 * (node.box.low + node.box.high) - p;
      const double away = length(to);
      const V u = away > 0 ? (1 / away) * to : V{0, 0, 0};
      for (std::uint32_t i = node.first_face; i < node.end_face; ++i) {
        const auto& f = mesh.faces[i];
        const V x = pair_.position(f[0]), y = pair_.position(f[1]), z = pair_.position(f[2]);
        const double along = std::min({dot(u, x - p), dot(u, y - p), dot(u, z - p)}) - 4e-15;
        if (along > 0 && along * along >= limit) continue;
        const V q = nearest_point(p, x, y, z), d = p - q;
        if (const double s = dot(d, d); s < square) square = s, best = {q, std::sqrt(s)}, set_limit();
      }
      if (best.distance <= enough) break;
    }
    return best;
  }

  static double length(const V& x) { return std::sqrt(dot(x, x)); }

  const MovedPair& pair_;
  double best_ = 0;
  V way_out_{};
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

std::vector<V> normals_of_contours(const MovedPair& pair, std::size_t most) {
  const BoxedMesh &a = pair.a(), &b = pair.b();
  // Curves are those of connected faces of a: their vertices are joined.
  std::uint32_t first = UINT32_MAX, last = 0;
  for (const auto& face : a.faces)
    for (const std::uint32_t v : face) first = std::min(first, v), last = std::max(last, v);
  std::vector<std::uint32_t> lower(last - first + 1);
  std::iota(lower.begin(), lower.end(), 0u);
  const auto find = [&](std::uint32_t vertex) {
    std::uint32_t v = vertex - first;
    while (lower[v] != v) v = lower[v] = lower[lower[v]];
    return v;
  };
  struct Segment {
    std::uint32_t vertex;
    V from, to;
  };
  std::vector<Segment> segments;
  const Moved at_rest{pair, {0, 0, 0}};
  any_near(pair, at_rest, at_rest, [&](std::uint32_t i, std::uint32_t k) {
    V x[3], y[3];
    for (std::size_t c = 0; c < 3; ++c) x[c] = pair.position(a.faces[i][c]), y[c] = pair.position(b.faces[k][c]);
    const V n = cross(x[1] - x[0], x[2] - x[0]), m = cross(y[1] - y[0], y[2] - y[0]), along = cross(n, m);
    // On the line that both planes contain: the part in both triangles.
    const auto part = [&](const V(&f)[3], const V& normal, const V& at, V(&ends)[2]) {
      int count = 0;
      for (int c = 0; c < 3; ++c) {
        const V &p = f[c], &q = f[(c + 1) % 3];
        const double s = dot(normal, p - at), t = dot(normal, q - at);
        if ((s < 0) != (t < 0)) ends[std::min(count++, 1)] = p + (s / (s - t)) * (q - p);
      }
      if (count == 2 && dot(along, ends[0]) > dot(along, ends[1])) std::swap(ends[0], ends[1]);
      return count == 2;
    };
    V p[2], q[2];
    if (!part(x, m, y[0], p) || !part(y, n, x[0], q)) return false;
    const V from = dot(along, p[0]) > dot(along, q[0]) ? p[0] : q[0];
    const V to = dot(along, p[1]) < dot(along, q[1]) ? p[1] : q[1];
    if (!(dot(along, from) < dot(along, to))) return false;
    segments.push_back({a.faces[i][0], from, to});
    for (const std::uint32_t v : a.faces[i]) {
      const std::uint32_t x = find(v), y = find(a.faces[i][0]);
      lower[std::max(x, y)] = std::min(x, y);
    }
    return false;
  });
  // Around the first point of each: the area of an open curve depends on it.
  std::map<std::uint32_t, std::pair<V, V>> area;
  for (const Segment& s : segments) {
    auto& [origin, sum] = area.try_emplace(find(s.vertex), s.from, V{0, 0, 0}).first->second;
    sum = sum + 0.5 * cross(s.from - origin, s.to - origin);
  }
  std::vector<V> normals;
  for (const auto& [vertex, of] : area) normals.push_back(of.second);
  std::ranges::stable_sort(normals, [](const V& x, const V& y) { return dot(x, x) > dot(y, y); });
  if (normals.size() > most) normals.resize(most);
  return normals;
}

DeepestVertex deepest_vertex(const MovedPair& pair) { return DeepestVertexSearch(pair).search(); }

}  // namespace hpccd
