// SPDX-License-Identifier: Apache-2.0
#include "solid/penetration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "solid/free_place.h"
#include "solid/translation.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

double length(const V& x) { return std::sqrt(dot(x, x)); }
V unit(const V& x) { return (1 / length(x)) * x; }

// All in the scale of BoxedMesh. A place is a translation of mesh a.
struct Place {
  V at;
  double depth = INFINITY;
  ContactTime contact;
};

// The plane of the features of a contact: normal and, of a triangle or a parallelogram, no area.
std::optional<V> normal_of(const MovedPair& pair, const ContactTime& contact) {
  const auto edge = [&](const std::array<std::uint32_t, 3>& of, std::size_t i) {
    return pair.position(of[i]) - pair.position(of[0]);
  };
  const auto &a = contact.a, &b = contact.b;
  if (contact.n_a + contact.n_b != 4) return std::nullopt;
  const V n = contact.n_a == 3   ? cross(edge(a, 1), edge(a, 2))
              : contact.n_b == 3 ? cross(edge(b, 1), edge(b, 2))
                                 : cross(edge(a, 1), edge(b, 1));
  const double size = length(n);
  if (!(size > 0)) return std::nullopt;
  return (1 / size) * n;
}

// The obstacle of places where the convex hulls meet: the hull of all differences of a vertex of b and one of a.
class HullOfPlaces {
 public:
  explicit HullOfPlaces(const MovedPair& pair) : pair_(pair) {}
  // The place that is farthest in a direction.
  V support(const V& d) const { return farthest(pair_.b(), d) - farthest(pair_.a(), {-d.x, -d.y, -d.z}); }

 private:
  V farthest(const BoxedMesh& mesh, const V& d) const {
    const auto reach = [&](const BoxedMesh::Box& box) {
      return (d.x > 0 ? box.high.x : box.low.x) * d.x + (d.y > 0 ? box.high.y : box.low.y) * d.y +
             (d.z > 0 ? box.high.z : box.low.z) * d.z;
    };
    double most = -INFINITY;
    V found{};
    stack_.assign(mesh.roots.begin(), mesh.roots.end());
    while (!stack_.empty()) {
      const BoxedMesh::Node& node = mesh.nodes[stack_.back()];
      stack_.pop_back();
      if (reach(node.box) <= most) continue;
      if (node.children) {
        const bool left = reach(mesh.nodes[node.children].box) >= reach(mesh.nodes[node.children + 1].box);
        stack_.push_back(node.children + left), stack_.push_back(node.children + !left);
      }
      for (std::uint32_t i = node.first_face; i < node.end_face; ++i)
        for (const std::uint32_t v : mesh.faces[i])
          if (const V x = pair_.position(v); dot(x, d) > most) most = dot(x, d), found = x;
    }
    return found;
  }

  const MovedPair& pair_;
  mutable std::vector<std::uint32_t> stack_;
};

// Directions on a sphere, in triangles that are bisected. In each corner the hull's support is known: a support x
// bounds the distance of all tangent planes whose normals are in the triangle from below by its least product with a
// corner (directions with a product above a positive number form a cap, which is convex on the sphere).
class Directions {
 public:
  explicit Directions(const HullOfPlaces& hull) : hull_(hull) {
    for (int axis = 0; axis < 3; ++axis)
      for (const double s : {1.0, -1.0}) add(axis == 0 ? V{s, 0, 0} : axis == 1 ? V{0, s, 0} : V{0, 0, s});
    for (const int x : {0, 1})
      for (const int y : {2, 3})
        for (const int z : {4, 5}) push({x, y, z});
  }
  // Until no direction is better by more than a relative tolerance, or there are as many.
  void refine(double tolerance, std::size_t most) {
    while (!cells_.empty() && corners_.size() < most && cells_.front().bound < (1 - tolerance) * best()) {
      const std::array<int, 3> c = cells_.front().corners;
      std::pop_heap(cells_.begin(), cells_.end());
      cells_.pop_back();
      // The longest side first.
      int k = 0;
      double least = 2;
      for (int i = 0; i < 3; ++i)
        if (const double p = dot(at(c[i]).direction, at(c[(i + 1) % 3]).direction); p < least) least = p, k = i;
      const int i = c[k], j = c[(k + 1) % 3], other = c[(k + 2) % 3];
      const auto [place, is_new] = between_.try_emplace(std::minmax(i, j), static_cast<int>(corners_.size()));
      if (is_new) add(unit(at(i).direction + at(j).direction));
      push({i, place->second, other}), push({place->second, j, other});
    }
  }
  struct Corner {
    V direction, support;
    double distance;  // of the tangent plane
  };
  const std::vector<Corner>& corners() const { return corners_; }
  double best() const { return best_; }

 private:
  struct Cell {
    double bound;
    std::array<int, 3> corners;
    bool operator<(const Cell& other) const { return bound > other.bound; }
  };
  const Corner& at(int i) const { return corners_[static_cast<std::size_t>(i)]; }
  void add(const V& d) {
    const V x = hull_.support(d);
    corners_.push_back({d, x, dot(x, d)});
    best_ = std::min(best_, corners_.back().distance);
  }
  void push(const std::array<int, 3>& c) {
    double bound = -INFINITY;
    for (const int i : c) {
      double least = INFINITY;
      for (const int j : c) least = std::min(least, dot(at(i).support, at(j).direction));
      bound = std::max(bound, least);
    }
    cells_.push_back({bound, c});
    std::push_heap(cells_.begin(), cells_.end());
  }

  const HullOfPlaces& hull_;
  std::vector<Corner> corners_;
  std::vector<Cell> cells_;
  std::map<std::pair<int, int>, int> between_;
  double best_ = INFINITY;
};

struct HalfSpace {
  V normal;
  double beyond;  // normal . x >= beyond
};

// The point of the intersection of a few half-spaces that is nearest to the origin, if one is found: the best feasible
// one among the nearest points of all intersections of up to three of their planes.
std::optional<V> nearest_point(const std::vector<HalfSpace>& spaces) {
  std::optional<V> best;
  const auto use = [&](const V& x) {
    if (best && dot(x, x) >= dot(*best, *best)) return;
    for (const HalfSpace& s : spaces)
      if (dot(s.normal, x) < s.beyond - 1e-14) return;
    best = x;
  };
  use({0, 0, 0});
  for (std::size_t i = 0; i < spaces.size(); ++i) {
    const auto& [n, c] = spaces[i];
    use(c * n);
    for (std::size_t j = 0; j < i; ++j) {
      const auto& [m, d] = spaces[j];
      const double p = dot(n, m), q = 1 - p * p;
      if (q < 1e-12) continue;
      use(((c - p * d) / q) * n + ((d - p * c) / q) * m);
      const V axis = cross(n, m);
      for (std::size_t k = 0; k < j; ++k) {
        const auto& [o, e] = spaces[k];
        const double volume = dot(axis, o);
        if (std::fabs(volume) < 1e-9) continue;
        use((1 / volume) * (c * cross(m, o) + d * cross(o, n) + e * axis));
      }
    }
  }
  return best;
}

class Search {
 public:
  explicit Search(const MovedPair& pair) : pair_(pair) {}

  // Beyond the last contact in a direction.
  Place exit(const V& direction) const {
    const auto end = Translation(pair_, direction, {0, 0, 0}, Decided::roughly).latest_end();
    if (!end) return {};
    const double depth = std::max(end->at, 1e-15);  // meshes that touch
    return {depth * direction, depth, *end};
  }

  // In a gap between contacts, the first one in a direction: a translation within a ring or an open box.
  Place first_gap(const V& direction) const {
    const ContactTime time = first_separation(Translation(pair_, direction));
    if (!(time.at > 0)) return {};
    return {time.at * direction, time.at, time};
  }

  // From the last contact along the normal of its features, as long as that is nearer: for convex meshes the foot of a
  // perpendicular on a face of the obstacle.
  Place descend(Place place) const {
    for (int step = 0; step < 32; ++step) {
      const std::optional<V> n = normal_of(pair_, place.contact);
      if (!n) break;
      const Place next = exit(dot(*n, place.at) < 0 ? V{-n->x, -n->y, -n->z} : *n);
      if (!(next.depth < place.depth * (1 - 1e-13))) break;
      place = next;
    }
    return place;
  }

  // PolyDepth (Je et al. 2012): the contacts on the way are linearised, and the origin is projected onto the
  // intersection of their half-spaces, which is where the way goes on.
  Place slide(const Place& start) const {
    const double clearance = 1e-9 * start.depth;
    Place best = start;
    V p = (1 + clearance / start.depth) * start.at;
    std::vector<HalfSpace> spaces;
    for (int step = 0; step < 24; ++step) {
      std::erase_if(spaces, [&](const HalfSpace& s) { return dot(s.normal, p) - s.beyond > 0.05 * start.depth; });
      if (spaces.size() > 10) spaces.erase(spaces.begin());
      const std::optional<V> target = nearest_point(spaces);
      if (!target || length(*target) >= length(p) - 2 * clearance) break;
      const V way = *target - p;
      const double far = length(way);
      const V direction = (1 / far) * way;
      const auto hit = Translation(pair_, direction, p, Decided::roughly).earliest_begin({});
      if (!hit || hit->at >= far) {
        p = *target;
        if (length(p) < best.depth) best.at = p, best.depth = length(p);
        if (spaces.empty()) break;
        spaces.clear();
        continue;
      }
      const std::optional<V> n = normal_of(pair_, *hit);
      if (!n) break;
      const V normal = dot(*n, direction) > 0 ? V{-n->x, -n->y, -n->z} : *n;
      const double until = std::max(0.0, hit->at - clearance);
      p = p + until * direction;
      spaces.push_back({normal, dot(normal, p) + std::min(0.0, -0.5 * (hit->at - until) * -dot(normal, direction))});
      if (length(p) < best.depth) best = {p, length(p), *hit};
    }
    return best;
  }

 private:
  const MovedPair& pair_;
};

// The shortest multiple of a place, a little longer if needed, that is free after rounding.
std::optional<V> certified(const MovedPair& pair, const Place& place) {
  if (!(place.depth > 0)) return std::nullopt;  // by rounding: the meshes are not free where they are
  const double up = 1 / pair.scale();
  // Times are within 2e-14, rounded positions within 1e-16.
  for (double more = 4e-16; more < 1e-6; more *= 8) {
    const V t = (up * (1 + more + more / std::max(place.depth, 1e-300))) * place.at;
    if (is_free(pair, t)) return t;
  }
  return std::nullopt;
}

Penetration result_of(const MovedPair& pair, const V& translation, const ContactTime& contact) {
  Penetration result;
  result.translation = {translation.x, translation.y, translation.z};
  const double most = max_norm(translation);
  if (most > 0) {
    const int top = std::ilogb(most);
    const V scaled{std::ldexp(translation.x, -top), std::ldexp(translation.y, -top), std::ldexp(translation.z, -top)};
    result.depth = std::ldexp(length(scaled), top);
  }
  const auto face_of = [](const BoxedMesh& mesh, std::array<std::uint32_t, 3> vertices) {
    for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
      auto sorted = mesh.faces[i];
      std::ranges::sort(sorted);
      if (sorted == vertices) return mesh.face_numbers[i];
    }
    return 0u;
  };
  if (contact.n_a == 1 && contact.n_b == 3)
    result.kind = GapKind::vertex_face, result.features = {contact.a[0], face_of(pair.b(), contact.b), 0, 0};
  else if (contact.n_a == 3 && contact.n_b == 1)
    result.kind = GapKind::vertex_face, result.features = {contact.b[0], face_of(pair.a(), contact.a), 0, 0};
  else if (contact.n_a == 2 && contact.n_b == 2)
    result.kind = GapKind::edge_edge, result.features = {contact.a[0], contact.a[1], contact.b[0], contact.b[1]};
  return result;
}

}  // namespace

Penetration penetration(const MovedPair& pair, const std::optional<V>& start) {
  if (is_free(pair, {0, 0, 0})) return {};
  const Search search(pair);
  std::vector<Place> places;
  const auto add = [&](const V& direction) {
    if (const Place place = search.exit(direction); place.depth < INFINITY) places.push_back(place);
  };
  const bool small = pair.a().faces.size() + pair.b().faces.size() < 2000;
  const auto add_gap = [&](const V& direction) {  // decided exactly, which takes long for large meshes
    if (const Place place = small ? search.first_gap(direction) : Place{}; place.depth < INFINITY)
      places.push_back(place);
  };
  const HullOfPlaces hull(pair);
  const double largest = start ? max_norm(*start) : 0;
  if (start && largest > 0) {
    const int top = std::ilogb(largest);
    const V direction = unit({std::ldexp(start->x, -top), std::ldexp(start->y, -top), std::ldexp(start->z, -top)});
    add(direction), add_gap(direction);
  }
  if (places.empty()) {
    // Of the hulls, to a thousandth; finer where that costs little.
    Directions directions(hull);
    directions.refine(0, 66);
    const std::size_t n_spread = directions.corners().size();
    directions.refine(small ? 1e-6 : 1e-3, small ? 6000 : 600);
    std::vector<Directions::Corner> order = directions.corners();
    const auto nearer = [](const auto& x, const auto& y) { return x.distance < y.distance; };
    std::stable_sort(order.begin() + static_cast<std::ptrdiff_t>(n_spread), order.end(), nearer);
    for (std::size_t i = 0; i < std::min(n_spread + 16, order.size()); ++i) add(order[i].direction);
    for (std::size_t i = 0; i < 6; ++i) add_gap(order[i].direction);  // along the axes
  }
  const auto shorter = [](const Place& x, const Place& y) { return x.depth < y.depth; };
  std::stable_sort(places.begin(), places.end(), shorter);
  const std::size_t n_starts = std::min<std::size_t>(places.size(), 6);
  for (std::size_t i = 0; i < n_starts; ++i) {
    const Place foot = search.descend(places[i]);
    places.push_back(foot);
    if (i < 3) places.push_back(search.slide(foot));
  }
  // The hulls' tangent planes are free in any case.
  std::stable_sort(places.begin(), places.end(), shorter);
  for (const Place& place : places)
    if (const auto t = certified(pair, place)) {
      Penetration result = result_of(pair, *t, place.contact);
      result.lower_bound = std::min(deepest_vertex(pair), result.depth);
      return result;
    }
  // Rounded coordinates hardly distinguish the meshes: far enough along an axis.
  for (double far = 1; far < 4; far *= 2)
    if (const V t{far / pair.scale(), 0, 0}; is_free(pair, t)) return result_of(pair, t, {});
  throw InvalidArgument("vertices: coordinates are too large for a translation that separates the meshes");
}

}  // namespace hpccd
