// SPDX-License-Identifier: Apache-2.0
#include "solid/penetration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <span>
#include <utility>
#include <vector>

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
  V support(const V& d) const {
    pair_.heed();
    return farthest(pair_.b(), d) - farthest(pair_.a(), {-d.x, -d.y, -d.z});
  }

 private:
  V farthest(const BoxedMesh& mesh, const V& d) const {
    const auto reach = [&](const BoxedMesh::Box& box) {
      return (d.x > 0 ? box.high.x : box.low.x) * d.x + (d.y > 0 ? box.high.y : box.low.y) * d.y +
             (d.z > 0 ? box.high.z : box.low.z) * d.z;
    };
    double most = -INFINITY;
    V found{};
    std::vector<std::uint32_t> stack{0};
    while (!stack.empty()) {
      const BoxedMesh::Node& node = mesh.nodes[stack.back()];
      stack.pop_back();
      if (reach(node.box) <= most) continue;
      if (node.children) {
        const bool left = reach(mesh.nodes[node.children].box) >= reach(mesh.nodes[node.children + 1].box);
        stack.push_back(node.children + left), stack.push_back(node.children + !left);
      }
      for (std::uint32_t i = node.first_face; i < node.end_face; ++i)
        for (const std::uint32_t v : mesh.faces[i])
          if (const V x = pair_.position(v); dot(x, d) > most) most = dot(x, d), found = x;
    }
    return found;
  }

  const MovedPair& pair_;
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

// After a time along a direction. Meshes that only touch are free after the least translation.
Place place_of(const ContactTime& time, const V& direction) {
  const double depth = std::max(time.at, 1e-15);
  return {depth * direction, depth, time};
}

class Search {
 public:
  explicit Search(const MovedPair& pair) : pair_(pair) {}

  // Beyond the last contact in a direction, if that is nearer than a limit.
  Place exit(const V& direction, double limit = INFINITY) const {
    const auto end = Translation(pair_, direction, {0, 0, 0}, Decided::roughly).latest_end(nullptr, limit);
    if (!end) return {};
    if (end->at > limit) return {{}, INFINITY, *end};
    return place_of(*end, direction);
  }

  // The first place along a direction that is free: before the last contact, one within a ring or an open box.
  Place first_gap(const V& direction) const {
    return place_of(first_separation(Translation(pair_, direction)), direction);
  }

  // The same within rounding errors, if that is nearer than a limit, and found in few steps. contact: one that is late
  // in this direction.
  Place gap(const V& direction, double limit, const ContactTime& contact) const {
    const Translation translation(pair_, direction, {0, 0, 0}, Decided::roughly);
    // While a vertex is inside the other mesh there is none: those of the contact mostly are for long.
    std::vector<Translation::Range> covered;
    for (int i = 0; i < contact.n_a; ++i)
      translation.inside_during(contact.a[static_cast<std::size_t>(i)], true, covered);
    for (int i = 0; i < contact.n_b; ++i)
      translation.inside_during(contact.b[static_cast<std::size_t>(i)], false, covered);
    for (const bool of_a : {true, false}) {
      const BoxedMesh& mesh = of_a ? pair_.a() : pair_.b();
      constexpr std::size_t n_samples = 32;
      const std::size_t every = mesh.faces.size() / n_samples + 1;
      for (std::size_t i = every / 2; i < mesh.faces.size(); i += every)
        translation.inside_during(mesh.faces[i][0], of_a, covered);
    }
    std::ranges::sort(covered, {}, &Translation::Range::low);
    ContactTime time;
    auto next = covered.begin();
    int steps = 0;
    const auto skip = [&] {
      for (; next != covered.end() && next->low <= time.at; ++next)
        if (next->high > time.at) time = {}, time.at = next->high;
    };
    while (skip(), time.at < limit && ++steps < 200) {
      const auto end = translation.latest_end(&time, time.at + time.error);
      if (end && translation.compare(*end, time) > 0) {
        time = *end;
        continue;
      }
      if (const Place place = place_of(time, direction); certified(pair_, place)) return place;
      const auto begin = translation.earliest_begin(time, limit);
      if (!begin) break;
      time = *begin;
    }
    return {};
  }

  // From the last contact along the normal of its features, as long as that is nearer: for convex meshes the foot of a
  // perpendicular on a face of the obstacle.
  Place descend(Place place) const {
    for (int step = 0; step < 32; ++step) {
      const std::optional<V> n = normal_of(pair_, place.contact);
      if (!n) break;
      const Place next = exit(dot(*n, place.at) < 0 ? -1 * *n : *n, place.depth);
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
      const auto hit = Translation(pair_, direction, p, Decided::roughly).earliest_begin({}, far);
      if (!hit || hit->at >= far) {
        if (!(length(*target) > 0)) break;  // by rounding: the meshes are not free there
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

// The places of several directions, in their order: those that are not much longer than the best one, or than a limit.
// The limit falls from batch to batch, which are as long for any number of threads.
std::vector<Place> exits(const Search& search, std::span<const V> directions, double limit, double much,
                         ThreadPool& pool) {
  constexpr std::size_t batch = 16;
  const auto reach = [&] { return much * limit + 1e-12; };
  std::vector<Place> all(directions.size());
  for (std::size_t first = 0; first < directions.size(); first += batch) {
    const std::size_t n = std::min(batch, directions.size() - first);
    parallel_for_each(pool, n, [&](std::size_t i) { all[first + i] = search.exit(directions[first + i], reach()); });
    for (std::size_t i = first; i < first + n; ++i) limit = std::min(limit, all[i].depth);
  }
  std::erase_if(all, [&](const Place& place) { return !(place.depth <= reach()); });
  return all;
}

bool shorter(const Place& x, const Place& y) { return x.depth < y.depth; }

// Axes of inertia of the vertices of the faces.
std::array<V, 3> principal_axes(const MovedPair& pair, const BoxedMesh& mesh) {
  V sum{0, 0, 0};
  for (const auto& face : mesh.faces) sum = sum + pair.position(face[0]);
  const V middle = (1 / static_cast<double>(mesh.faces.size())) * sum;
  double m[3][3] = {};
  for (const auto& face : mesh.faces) {
    const V d = pair.position(face[0]) - middle;
    const double x[3] = {d.x, d.y, d.z};
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) m[i][k] += x[i] * x[k];
  }
  // Jacobi rotations.
  V axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int sweep = 0; sweep < 8; ++sweep)
    for (int i = 0; i < 2; ++i)
      for (int k = i + 1; k < 3; ++k) {
        if (m[i][k] == 0) continue;
        const double h = 0.5 * (m[k][k] - m[i][i]) / m[i][k];
        const double t = (h < 0 ? -1 : 1) / (std::fabs(h) + std::sqrt(h * h + 1)), c = 1 / std::sqrt(t * t + 1),
                     s = t * c;
        const auto rotate = [&](auto& x, auto& y) {
          const auto old = x;
          x = c * old - s * y, y = s * old + c * y;
        };
        for (auto& row : m) rotate(row[i], row[k]);
        for (int r = 0; r < 3; ++r) rotate(m[i][r], m[k][r]);
        rotate(axes[i], axes[k]);
      }
  return {axes[0], axes[1], axes[2]};
}

// The best places of those, the shortest first, in different directions.
std::vector<Place> starts_of(std::vector<Place> places, std::size_t most) {
  std::ranges::stable_sort(places, shorter);
  std::vector<Place> starts;
  for (const Place& place : places) {
    const bool is_new = std::ranges::none_of(
        starts, [&](const Place& other) { return dot(place.at, other.at) > 0.97 * place.depth * other.depth; });
    if (is_new && starts.size() < most) starts.push_back(place);
  }
  return starts;
}

// How far a search goes. For large meshes directions cost more and, with 60 pairs of tori and bumpy spheres of 2,000 to
// 7,000 faces, these numbers find translations that are 0.05 % longer on average, in 60 % of the time.
struct Effort {
  std::size_t n_around, n_of_hulls;  // directions
  double hull_tolerance;
  std::size_t n_hull_directions;
  double reach;  // how much longer a place may be and lead to a shorter one
  std::size_t n_starts, n_slides;
};
constexpr Effort small_effort{66, 16, 1e-6, 6000, 1.2, 6, 3}, large_effort{34, 6, 1e-3, 200, 1.1, 4, 2};

// Directions all around, and a few that are good for the hulls.
std::vector<V> directions_of_hulls(const HullOfPlaces& hull, const Effort& effort, double& nearest) {
  Directions directions(hull);
  directions.refine(0, effort.n_around);
  const std::size_t n_spread = directions.corners().size();
  directions.refine(effort.hull_tolerance, effort.n_hull_directions);
  nearest = directions.best();
  std::vector<Directions::Corner> order = directions.corners();
  const auto nearer = [](const auto& x, const auto& y) { return x.distance < y.distance; };
  std::stable_sort(order.begin() + static_cast<std::ptrdiff_t>(n_spread), order.end(), nearer);
  order.resize(std::min(n_spread + effort.n_of_hulls, order.size()));
  std::ranges::stable_sort(order, nearer);
  std::vector<V> result;
  for (const auto& corner : order) result.push_back(corner.direction);
  return result;
}

}  // namespace

Penetration penetration(const MovedPair& pair, const std::optional<V>& start, ThreadPool& pool) {
  if (is_free(pair, {0, 0, 0})) return {};
  const Search search(pair);
  const bool small = pair.a().faces.size() + pair.b().faces.size() < 2000;
  const Effort& effort = small ? small_effort : large_effort;
  if (small) pair.bits();  // before threads share it
  DeepestVertex deepest;
  std::vector<Place> places;
  // Exactly where that does not take long.
  const auto gap = [&](const V& direction, double limit, const ContactTime& late) {
    return small ? search.first_gap(direction) : search.gap(direction, limit, late);
  };
  const auto local_search = [&](const Place& from, bool slides) {
    const Place foot = search.descend(from);
    return slides ? search.slide(foot) : foot;
  };
  const double largest = start ? max_norm(*start) : 0;
  if (start && largest > 0) {
    const int top = std::ilogb(largest);
    const V direction = unit({std::ldexp(start->x, -top), std::ldexp(start->y, -top), std::ldexp(start->z, -top)});
    Place near, in_gap;
    parallel_for_each(pool, 2, [&](std::size_t task) {
      if (task == 0) {
        deepest = deepest_vertex(pair);
        return;
      }
      const Place from = search.exit(direction);
      if (!(from.depth < INFINITY)) return;
      near = local_search(from, true);
      in_gap = gap(direction, near.depth, from.contact);
      if (in_gap.depth < near.depth) in_gap = local_search(in_gap, true);
    });
    for (const Place& place : {near, in_gap})
      if (place.depth < INFINITY) places.push_back(place);
  }
  if (places.empty()) {
    std::vector<V> directions, normals;
    double limit = INFINITY;
    parallel_for_each(pool, 3, [&](std::size_t task) {
      if (task == 0) deepest = deepest_vertex(pair);
      if (task == 1) directions = directions_of_hulls(HullOfPlaces(pair), effort, limit);
      if (task == 2) normals = normals_of_contours(pair, 4);
    });
    for (const BoxedMesh* mesh : {&pair.a(), &pair.b()})
      for (const V& axis : principal_axes(pair, *mesh)) normals.push_back(axis);
    for (const V& n : normals)
      if (const double most = max_norm(n); most > 1e-150)
        for (const double sign : {1.0, -1.0}) directions.push_back(unit((sign / most) * n));
    if (const double most = max_norm(deepest.way_out); most > 0)
      directions.push_back(unit((1 / most) * deepest.way_out));
    places = exits(search, directions, limit, effort.reach, pool);
    const std::vector<Place> from = starts_of(places, effort.n_starts);
    for (const Place& place : places) limit = std::min(limit, place.depth);
    std::vector<Place> found(from.size() + 6);
    parallel_for_each(pool, found.size(), [&](std::size_t i) {
      if (i < from.size()) {
        found[i] = local_search(from[i], i < effort.n_slides);
        return;
      }
      const std::size_t axis = i - from.size();
      const double sign = axis % 2 ? -1 : 1;
      const V direction = axis < 2 ? V{sign, 0, 0} : axis < 4 ? V{0, sign, 0} : V{0, 0, sign};
      found[i] = gap(direction, limit, search.exit(direction, limit).contact);
      if (found[i].depth < limit) found[i] = local_search(found[i], true);
    });
    std::ranges::copy_if(found, std::back_inserter(places), [](const Place& place) { return place.depth < INFINITY; });
  }
  // The hulls' tangent planes are free in any case.
  std::ranges::stable_sort(places, shorter);
  const auto with_bound = [&](Penetration result) {
    result.lower_bound = std::min(deepest.depth, result.depth);
    return result;
  };
  for (const Place& place : places)
    if (const auto t = certified(pair, place)) return with_bound(result_of(pair, *t, place.contact));
  // Faces without extent meet in no interval of positive length. Twice the unit of the scale is far enough: scaled
  // coordinates are below 1, so then even the boxes are apart.
  V t;
  double far = 0x1p-51;
  do t = {far / pair.scale(), 0, 0}, far *= 4;
  while (!is_free(pair, t));
  return with_bound(result_of(pair, t, {}));
}

}  // namespace hpccd
