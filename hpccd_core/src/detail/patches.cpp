// SPDX-License-Identifier: Apache-2.0
#include "detail/patches.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

#include "base/vec3.h"
#include "bvh/bad_coordinate.h"
#include "scene/face_adjacency.h"

namespace hpccd::detail {
namespace {

using Vec = Vec3<double>;

struct Weights {
  double b1, b2;
};

// Those of the point of a triangle that is nearest to p (Ericson, Real-Time Collision Detection, 5.1.5). A choice only:
// rounding makes the map a little worse, and its deviation is measured.
Weights nearest(Vec p, Vec a, Vec b, Vec c) {
  const Vec ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp),
               d6 = dot(ac, cp);
  if (d1 <= 0 && d2 <= 0) return {0, 0};
  if (d3 >= 0 && d4 <= d3) return {1, 0};
  if (d6 >= 0 && d5 <= d6) return {0, 1};
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {d1 / (d1 - d3), 0};
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {0, d2 / (d2 - d6)};
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {1 - w, w};
  }
  return {vb / (va + vb + vc), vc / (va + vb + vc)};
}

// Weights with a sum of at most 1. NaN, of a triangle without area, becomes 0.
struct OnGrid {
  Weight b1, b2;
};
OnGrid on_grid(Weights w) {
  constexpr int all = 1 << 15;
  const auto rounded = [](double x) { return x >= 0 ? static_cast<int>(std::min(x, 1.0) * all + 0.5) : 0; };
  const int b1 = rounded(w.b1), b2 = std::min(rounded(w.b2), all - b1);
  return {{static_cast<std::uint16_t>(b1)}, {static_cast<std::uint16_t>(b2)}};
}

bool is_corner(const Face& f, std::uint32_t v) { return f[0] == v || f[1] == v || f[2] == v; }

struct SegmentParameters {
  double s, r;
};

// Those of the nearest points of two segments (Ericson, 5.1.9). A choice only, as above.
SegmentParameters crossing_of(Vec p, Vec q, Vec a, Vec b) {
  const Vec d1 = q - p, d2 = b - a, between = p - a;
  const double l1 = dot(d1, d1), l2 = dot(d2, d2), f = dot(d2, between), c = dot(d1, between), m = dot(d1, d2);
  const double area = l1 * l2 - m * m;
  double s = area > 0 ? std::clamp((m * f - c * l2) / area, 0.0, 1.0) : 0.5;
  double r = l2 > 0 ? (m * s + f) / l2 : 0.0;
  if (r < 0 || r > 1) {
    r = std::clamp(r, 0.0, 1.0);
    s = l1 > 0 ? std::clamp((m * r - c) / l1, 0.0, 1.0) : 0.0;
  }
  return {s, r};
}

Weight on_grid(double x) { return on_grid(Weights{x, 0}).b1; }

// Rows of numbers, ascending and each once, by an index.
struct Rows {
  std::vector<std::uint64_t> first;
  std::vector<std::uint32_t> values;
  std::span<const std::uint32_t> operator[](std::size_t i) const {
    return std::span(values).subspan(first[i], first[i + 1] - first[i]);
  }
  // fill(i, row) for each row, by all threads.
  template <class Fill>
  Rows(std::size_t n, ThreadPool& pool, Fill&& fill) : first(n + 1, 0) {
    constexpr std::size_t grain = 256;
    std::vector<std::vector<std::uint32_t>> pieces((n + grain - 1) / grain);
    parallel_for(pool, n, grain, [&](std::size_t begin, std::size_t end, int) {
      std::vector<std::uint32_t>& piece = pieces[begin / grain];
      std::vector<std::uint32_t> row;
      for (std::size_t i = begin; i < end; ++i) {
        row.clear();
        fill(i, row);
        std::sort(row.begin(), row.end());
        row.erase(std::unique(row.begin(), row.end()), row.end());
        piece.insert(piece.end(), row.begin(), row.end());
        first[i + 1] = row.size();
      }
    });
    for (std::size_t i = 0; i < n; ++i) first[i + 1] += first[i];
    values.reserve(first[n]);
    for (const auto& piece : pieces) values.insert(values.end(), piece.begin(), piece.end());
  }
};

constexpr std::uint32_t no_face = 0xFFFFFFFFu;

// A corner of a piece: a vertex (v == w), or a crossing of an edge with a coarse edge. `labels`: coarse faces in which
// its point lies.
struct Corner {
  std::uint32_t v, w;
  Weight s{}, r{};
  Edge edge{};                             // the coarse edge
  std::array<std::uint32_t, 2> of_edge{};  // the coarse faces at it
  std::span<const std::uint32_t> of_vertex{};
  bool is_vertex() const { return v == w; }
  std::span<const std::uint32_t> labels() const { return is_vertex() ? of_vertex : std::span(of_edge); }
};

// Lists of pieces, in the order of the faces.
struct Pieces {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> held;  // coarse face, face
  std::vector<std::pair<std::uint32_t, MappedVertex>> vertices;
  std::vector<std::pair<std::uint32_t, MappedPoint>> points;
  std::vector<std::pair<Edge, Crossing>> crossings;
};

class Mapping {
 public:
  Mapping(std::span<const Face> faces, std::span<const Face> coarse, std::span<const std::uint32_t> survivor,
          Positions rest, ThreadPool& pool)
      : faces_(faces),
        coarse_(coarse),
        survivor_(survivor),
        rest_(rest),
        at_(coarse_, rest.n),
        labels_(rest.n, pool,
                [&](std::size_t v, std::vector<std::uint32_t>& row) { labels_of(static_cast<std::uint32_t>(v), row); }),
        beside_(coarse.size(), pool, [&](std::size_t c, std::vector<std::uint32_t>& row) {
          for (const std::uint32_t corner : coarse_[c])
            for (const std::uint32_t d : at_.faces_of(corner))
              if (common_edge(static_cast<std::uint32_t>(c), d)) row.push_back(d);
        }) {}

  // False if the face remains as it is.
  bool cut(std::uint32_t number, Pieces& to) const {
    std::vector<Corner> ring, cuts;
    bool cut = true;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = faces_[number][k], w = faces_[number][(k + 1) % 3];
      if (labels_[v].empty()) return false;
      ring.push_back(corner(v));
      cuts.clear();
      if (labels_[w].empty()) return false;
      if (v != w && !crossings(std::min(v, w), std::max(v, w), cuts)) cut = false;
      if (v > w) std::reverse(cuts.begin(), cuts.end());
      ring.insert(ring.end(), cuts.begin(), cuts.end());
    }
    if (!cut) std::erase_if(ring, [](const Corner& c) { return !c.is_vertex(); });
    // The corners lie around the face: removing one at a time, with the triangle of its neighbours, leaves a smaller
    // polygon, until a piece has corners in no common coarse face.
    while (ring.size() >= 3) {
      const std::size_t n = ring.size();
      std::size_t i = 0;
      std::uint32_t face = no_face;
      for (; i < n && face == no_face; ++i) face = common(ring[(i + n - 1) % n], ring[i], ring[(i + 1) % n]);
      if (face == no_face) break;
      --i;
      for (const Corner& c : {ring[(i + n - 1) % n], ring[i], ring[(i + 1) % n]}) list(c, face, to);
      to.held.push_back({face, number});
      ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(i));
    }
    if (ring.size() >= 3) map_to_one(number, ring, to);
    return true;
  }

 private:
  struct Best {
    double distance;
    std::uint32_t face;
    void offer(double d, std::uint32_t f) {
      if (d < distance || (d == distance && f < face)) *this = {d, f};
    }
  };
  static constexpr Best none{std::numeric_limits<double>::infinity(), no_face};

  Vec at(std::uint32_t v) const {
    const auto* x = static_cast<const double*>(rest_.data) + 3 * std::size_t{v};
    return {x[0], x[1], x[2]};
  }
  Vec at(const Corner& c) const { return at(c.v) + double{c.s} * (at(c.w) - at(c.v)); }
  OnGrid weights(Vec p, std::uint32_t face) const {
    const Face& f = coarse_[face];
    return on_grid(nearest(p, at(f[0]), at(f[1]), at(f[2])));
  }
  double square_to(Vec p, std::uint32_t face) const {
    const auto [b1, b2] = weights(p, face);
    const Face& f = coarse_[face];
    const Vec d = p - ((1.0 - b1 - b2) * at(f[0]) + double{b1} * at(f[1]) + double{b2} * at(f[2]));
    return dot(d, d);
  }
  // First of the coarse faces at the survivor, then descending to those that share a vertex with the best so far.
  std::uint32_t nearest_to(std::uint32_t v) const {
    Best best = none;
    if (survivor_[v] == no_vertex) return no_face;
    for (const std::uint32_t c : at_.faces_of(survivor_[v])) best.offer(square_to(at(v), c), c);
    constexpr int most_descents = 64;
    for (int i = 0; i < most_descents && best.face != no_face; ++i) {
      const std::uint32_t before = best.face;
      for (const std::uint32_t corner : coarse_[before])
        for (const std::uint32_t c : at_.faces_of(corner)) best.offer(square_to(at(v), c), c);
      if (best.face == before) break;
    }
    return best.face;
  }
  // The coarse faces in which a vertex lies: those at it; or the nearest one, and others about as near: many
  // vertices of regular nets lie on coarse edges.
  void labels_of(std::uint32_t v, std::vector<std::uint32_t>& row) const {
    if (survivor_[v] == no_vertex) return;
    if (const auto faces = at_.faces_of(v); !faces.empty()) return row.assign(faces.begin(), faces.end());
    const std::uint32_t nearest = nearest_to(v);
    if (nearest == no_face) return;
    row.push_back(nearest);
    const Face& f = coarse_[nearest];
    const Vec e = at(f[1]) - at(f[0]), d = at(f[2]) - at(f[0]);
    const double most = std::sqrt(square_to(at(v), nearest)) + 0.01 * std::sqrt(std::max(dot(e, e), dot(d, d)));
    for (const std::uint32_t corner : f)
      for (const std::uint32_t c : at_.faces_of(corner))
        if (square_to(at(v), c) <= most * most) row.push_back(c);
  }
  Corner corner(std::uint32_t v) const { return {.v = v, .w = v, .of_vertex = labels_[v]}; }

  // The common edge of two coarse faces, if they have exactly two common corners.
  std::optional<Edge> common_edge(std::uint32_t c, std::uint32_t d) const {
    Edge edge{};
    std::size_t n = 0;
    for (const std::uint32_t v : coarse_[c])
      if (is_corner(coarse_[d], v)) {
        if (n == 2) return std::nullopt;
        edge[n++] = v;
      }
    if (n != 2 || edge[0] == edge[1]) return std::nullopt;
    return Edge{std::min(edge[0], edge[1]), std::max(edge[0], edge[1])};
  }
  Corner crossing(std::uint32_t v, std::uint32_t w, std::uint32_t c, std::uint32_t d, Edge edge) const {
    const SegmentParameters at_rest = crossing_of(at(v), at(w), at(edge[0]), at(edge[1]));
    return {.v = v, .w = w, .s = on_grid(at_rest.s), .r = on_grid(at_rest.r), .edge = edge, .of_edge = {c, d}};
  }
  double square_of(const Corner& c) const {
    const Vec d = at(c) - (at(c.edge[0]) + double{c.r} * (at(c.edge[1]) - at(c.edge[0])));
    return dot(d, d);
  }
  // The coarse edges from a coarse face at v to one at w: the nearest sequence of up to four, but no longer one where a
  // shorter one passes within a tenth of the edge. (Two coarse faces with a common edge may lie on both sides of a
  // third one, where the way across their common edge is far.) False if there is none.
  bool crossings(std::uint32_t v, std::uint32_t w, std::vector<Corner>& to) const {
    constexpr int most = 4;
    for (const std::uint32_t c : labels_[v])
      if (std::ranges::find(labels_[w], c) != labels_[w].end()) return true;
    const Vec edge = at(w) - at(v);
    const double near = 0.01 * dot(edge, edge);
    Sequence best{{}, std::numeric_limits<double>::infinity()}, sequence;
    for (int n = 1; n <= most && !(best.farthest <= near); ++n)
      for (const std::uint32_t c : labels_[v]) extend(sequence, v, w, c, n, best);
    to = best.cuts;
    return !to.empty();
  }
  struct Sequence {
    std::vector<Corner> cuts;
    double farthest = 0;  // the largest square
  };
  // Of the sequences with n more edges from this coarse face on, the best.
  void extend(Sequence& so_far, std::uint32_t v, std::uint32_t w, std::uint32_t c, int n, Sequence& best) const {
    for (const std::uint32_t d : beside_[c]) {
      Corner cut = crossing(v, w, c, d, *common_edge(c, d));
      if (!so_far.cuts.empty()) cut.s = std::max(cut.s, so_far.cuts.back().s);
      const double before = so_far.farthest, farthest = std::max(before, square_of(cut));
      if (!(farthest < best.farthest)) continue;
      so_far.cuts.push_back(cut);
      so_far.farthest = farthest;
      if (n > 1)
        extend(so_far, v, w, d, n - 1, best);
      else if (std::ranges::find(labels_[w], d) != labels_[w].end())
        best = so_far;
      so_far.cuts.pop_back();
      so_far.farthest = before;
    }
  }

  static std::uint32_t common(const Corner& a, const Corner& b, const Corner& c) {
    for (const std::uint32_t face : a.labels())
      if (std::ranges::find(b.labels(), face) != b.labels().end() &&
          std::ranges::find(c.labels(), face) != c.labels().end())
        return face;
    return no_face;
  }
  MappedVertex mapped(std::uint32_t v, std::uint32_t face) const {
    const auto [b1, b2] = weights(at(v), face);
    return {v, b1, b2};
  }
  void list(const Corner& c, std::uint32_t face, Pieces& to) const {
    if (!c.is_vertex())
      to.crossings.push_back({c.edge, {c.v, c.w, c.s, c.r}});
    else if (!is_corner(coarse_[face], c.v))
      to.vertices.push_back({face, mapped(c.v, face)});
  }
  // Maps the whole polygon to the coarse face nearest to its farthest corner.
  void map_to_one(std::uint32_t number, std::span<const Corner> ring, Pieces& to) const {
    Best best = none;
    for (const Corner& c : ring)
      for (const std::uint32_t face : c.labels()) {
        double farthest = 0;
        for (const Corner& other : ring) farthest = std::max(farthest, square_to(at(other), face));
        best.offer(farthest, face);
      }
    for (const Corner& c : ring)
      if (c.is_vertex()) {
        list(c, best.face, to);
      } else {
        const auto [b1, b2] = weights(at(c), best.face);
        to.points.push_back({best.face, {c.v, c.w, c.s, b1, b2}});
      }
    to.held.push_back({best.face, number});
  }

  std::span<const Face> faces_, coarse_;
  std::span<const std::uint32_t> survivor_;
  Positions rest_;
  FaceAdjacency at_;
  Rows labels_;  // by vertex
  Rows beside_;  // by coarse face, those with a common edge
};

void check(const char* name, std::span<const Face> faces, std::size_t n_vertices) {
  for (const Face& f : faces)
    if (std::ranges::any_of(f, [&](std::uint32_t v) { return v >= n_vertices; }))
      throw InvalidArgument(std::string(name) + ": an index is beyond the " + std::to_string(n_vertices) +
                            " vertices; give those of the same mesh");
}

// By vertex: the least vertex that faces connect it to.
std::vector<std::uint32_t> components(std::span<const Face> faces, std::size_t n_vertices) {
  std::vector<std::uint32_t> parent(n_vertices);
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const Face& f : faces)
    for (const std::uint32_t v : {f[1], f[2]}) {
      const std::uint32_t a = root(f[0]), b = root(v);
      parent[std::max(a, b)] = std::min(a, b);
    }
  for (std::uint32_t v = 0; v < n_vertices; ++v) parent[v] = root(v);
  return parent;
}

// Sorted, each once, and grouped by number below n.
template <class T, class Key>
Grouped<T> grouped(std::vector<std::pair<Key, T>>& all, std::size_t n, auto&& number_of) {
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  if (all.size() > UINT32_MAX) throw InvalidArgument("faces: too many for detail; divide the mesh");
  Grouped<T> groups{std::vector<std::uint32_t>(n + 1, 0), {}};
  groups.rows.reserve(all.size());
  for (const auto& [key, row] : all) ++groups.first[number_of(key) + 1], groups.rows.push_back(row);
  for (std::size_t i = 0; i < n; ++i) groups.first[i + 1] += groups.first[i];
  return groups;
}

template <class Real>
Vec position(const Real* x, std::uint32_t v) {
  return {x[3 * std::size_t{v}], x[3 * std::size_t{v} + 1], x[3 * std::size_t{v} + 2]};
}

double largest_of(Vec v) { return std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}); }

// A bound on |p - q| for points p and the points q to which they are mapped, from the largest computed square.
//
// With u = 2^-53 and all coordinates at most M in magnitude: a point of an edge is computed as v + s (w - v), with
// errors of 2 u M of the difference, 2 u M of the product and u M of the sum: 5 u M for each coordinate. A point of a
// face is computed as X0 + (b1 (X1 - X0) + b2 (X2 - X0)): the differences with the products have 4 u M together, since
// b1 + b2 <= 1, the inner sum 2 u M and the outer one u M: 7 u M. With 2 u M of p - q that is at most 14 u M, 15 u M
// with terms of second order, so sqrt(3) 15 u M < 26 u M for the length. The squares, their sum and the root have a
// relative error below 4 u, and underflow hides at most sqrt(3 2^-1074) < 2^-536. Squares that overflow are replaced by
// the bound |p - q| <= sqrt(3) 2 M.
double bound_of(double square, double largest) {
  constexpr double u = 0x1p-53;
  return std::isinf(square) ? 4 * largest : std::sqrt(square) * (1 + 8 * u) + 26 * u * largest + 0x1p-536;
}

// Squares of distances. Their sum shows what the largest hides: it is NaN or huge if one is.
struct Squares {
  double most = 0, sum = 0;
  void add(Vec p, Vec q) {
    const Vec d = p - q;
    const double square = dot(d, d);
    most = std::max(most, square);
    sum += square;
  }
  void include(const Squares& s) { most = std::max(most, s.most), sum += s.sum; }
};

// Both return the largest square of their own, and include all squares in the sum.
template <class Real>
double square_of_edge(Edge edge, std::span<const Crossing> crossings, const Real* x, Squares& all) {
  Squares found;
  const Vec a = position(x, edge[0]), ab = position(x, edge[1]) - a;
  for (const Crossing& c : crossings) {
    const Vec v = position(x, c.v), w = position(x, c.w);
    found.add(v + double{c.s} * (w - v), a + double{c.r} * ab);
  }
  all.include(found);
  return found.most;
}

struct SquaresOfFace {
  double of_all, of_vertices;
};
template <class Real>
SquaresOfFace squares_of_face(Vec x0, Vec e1, Vec e2, std::span<const MappedVertex> vertices,
                              std::span<const MappedPoint> points, const Real* x, Squares& all) {
  Squares found;
  for (const MappedVertex& m : vertices) {
    const Vec v = position(x, m.vertex);
    found.add(v, x0 + (double{m.b1} * e1 + double{m.b2} * e2));
  }
  const double of_vertices = found.most;
  for (const MappedPoint& m : points) {
    const Vec v = position(x, m.v), w = position(x, m.w);
    found.add(v + double{m.s} * (w - v), x0 + (double{m.b1} * e1 + double{m.b2} * e2));
  }
  all.include(found);
  return {found.most, of_vertices};
}

// The transpose: by value below n, the rows that contain it.
Rows transposed(const Rows& rows, std::size_t n, ThreadPool& pool) {
  std::vector<std::uint64_t> begin(n + 2, 0);
  for (const std::uint32_t v : rows.values) ++begin[v + 2];
  for (std::size_t i = 2; i < begin.size(); ++i) begin[i] += begin[i - 1];
  std::vector<std::uint32_t> containing(rows.values.size());
  for (std::uint32_t i = 0; i + 1 < rows.first.size(); ++i)
    for (const std::uint32_t v : rows[i]) containing[begin[v + 1]++] = i;
  return Rows(n, pool, [&](std::size_t i, std::vector<std::uint32_t>& row) {
    row.assign(containing.begin() + static_cast<std::ptrdiff_t>(begin[i]),
               containing.begin() + static_cast<std::ptrdiff_t>(begin[i + 1]));
  });
}

}  // namespace

Patches patches_of(std::span<const Face> faces, std::span<const Face> proposed, std::span<const std::uint32_t> survivor,
                   Positions rest, ThreadPool& pool) {
  check("faces", faces, rest.n), check("proposed", proposed, rest.n);
  if (survivor.size() != rest.n || !rest.is_double)
    throw InvalidArgument("survivor, rest: expected one entry for each vertex, positions in double precision");
  if (std::ranges::any_of(survivor, [&](std::uint32_t v) { return v != no_vertex && v >= rest.n; }))
    throw InvalidArgument("survivor: an index is beyond the vertices");
  // A component that collapsed may have been moved to another one.
  const std::vector<std::uint32_t> component = components(faces, rest.n);
  std::vector<Face> coarse;
  for (const Face& f : proposed)
    if (component[f[0]] == component[f[1]] && component[f[0]] == component[f[2]]) coarse.push_back(f);
  std::vector<std::uint32_t> near(survivor.begin(), survivor.end());
  for (std::uint32_t v = 0; v < rest.n; ++v)
    if (near[v] != no_vertex && component[near[v]] != component[v]) near[v] = no_vertex;
  Pieces all;
  std::vector<std::uint32_t> kept;
  {
    const Mapping mapping(faces, coarse, near, rest, pool);
    constexpr std::size_t grain = 1024;
    std::vector<Pieces> parts((faces.size() + grain - 1) / grain);
    std::vector<std::vector<std::uint32_t>> kept_parts(parts.size());
    parallel_for(pool, faces.size(), grain, [&](std::size_t begin, std::size_t end, int) {
      for (auto i = static_cast<std::uint32_t>(begin); i < end; ++i)
        if (!mapping.cut(i, parts[begin / grain])) kept_parts[begin / grain].push_back(i);
    });
    const auto append = [](auto& to, auto& from) { to.insert(to.end(), from.begin(), from.end()), from = {}; };
    for (Pieces& part : parts)
      append(all.held, part.held), append(all.vertices, part.vertices), append(all.points, part.points),
          append(all.crossings, part.crossings);
    for (auto& part : kept_parts) append(kept, part);
  }
  for (const std::uint32_t face : kept) {
    all.held.push_back({static_cast<std::uint32_t>(coarse.size()), face});
    coarse.push_back(faces[face]);
  }
  // Coarse faces without a piece are left out.
  std::vector<std::uint32_t> number(coarse.size(), no_face);
  for (const auto& [c, face] : all.held) number[c] = 0;
  Patches p;
  for (std::uint32_t c = 0; c < coarse.size(); ++c)
    if (number[c] == 0) number[c] = static_cast<std::uint32_t>(p.faces.size()), p.faces.push_back(coarse[c]);
  const auto of_face = [&](std::uint32_t c) { return number[c]; };
  const std::size_t n = p.faces.size();
  p.held = grouped(all.held, n, of_face);
  p.vertices = grouped(all.vertices, n, of_face);
  p.points = grouped(all.points, n, of_face);
  std::vector<Edge> edges;
  for (const auto& [edge, crossing] : all.crossings) edges.push_back(edge);
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  constexpr std::uint32_t none = UINT32_MAX;
  std::vector<std::uint32_t> number_of_edge(edges.size(), none);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> crossed;
  for (std::uint32_t c = 0; c < n; ++c) {
    p.first_edge.push_back(static_cast<std::uint32_t>(p.edges.size()));
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [a, b] = std::minmax(p.faces[c][k], p.faces[c][(k + 1) % 3]);
      const Edge edge{a, b};
      const auto found = std::ranges::lower_bound(edges, edge);
      if (found == edges.end() || *found != edge) continue;
      std::uint32_t& e = number_of_edge[static_cast<std::size_t>(found - edges.begin())];
      if (e == none) e = static_cast<std::uint32_t>(p.edges.size()), p.edges.push_back(edge);
      crossed.push_back({c, e});
    }
  }
  p.first_edge.push_back(static_cast<std::uint32_t>(p.edges.size()));
  const auto as_it_is = [](std::uint32_t i) { return i; };
  p.crossed = grouped(crossed, n, as_it_is);
  std::vector<std::pair<std::uint32_t, Crossing>> crossings;
  for (const auto& [edge, crossing] : all.crossings)
    crossings.push_back(
        {number_of_edge[static_cast<std::size_t>(std::ranges::lower_bound(edges, edge) - edges.begin())], crossing});
  p.crossings = grouped(crossings, p.edges.size(), as_it_is);
  return p;
}

std::vector<double> largest_coordinates(const char* name, Positions vertices,
                                        std::span<const std::int64_t> first_vertex, double most, ThreadPool& pool) {
  std::vector<double> of_meshes;
  const auto measure = [&]<class Real>(const Real* x) {
    for (std::size_t mesh = 0; mesh + 1 < first_vertex.size(); ++mesh) {
      const auto from = 3 * static_cast<std::size_t>(first_vertex[mesh]),
                 to = 3 * static_cast<std::size_t>(first_vertex[mesh + 1]);
      std::vector<Real> of_threads(static_cast<std::size_t>(pool.size()), 0);
      std::atomic<bool> good{true};
      parallel_for(pool, to - from, 1 << 14, [&](std::size_t begin, std::size_t end, int thread) {
        Real largest = of_threads[static_cast<std::size_t>(thread)];
        bool all = true;
        for (std::size_t i = from + begin; i < from + end; ++i) {
          const Real size = std::fabs(x[i]);
          all &= size <= most;  // false for NaN
          largest = std::max(largest, size);
        }
        if (!all) good = false;
        of_threads[static_cast<std::size_t>(thread)] = largest;
      });
      if (!good) report_bad(name, x, vertices.n, most);
      of_meshes.push_back(*std::ranges::max_element(of_threads));
    }
  };
  vertices.is_double ? measure(static_cast<const double*>(vertices.data))
                     : measure(static_cast<const float*>(vertices.data));
  return of_meshes;
}

std::optional<std::vector<double>> deviations(const Patches& p, Positions vertices, std::uint32_t first_vertex,
                                              std::optional<double> largest, double most, ThreadPool& pool) {
  std::vector<double> of(p.faces.size(), 0), of_edges(p.edges.size(), 0);
  std::atomic<bool> exceeded{false}, huge{false};
  struct alignas(64) OfThread {
    double corner = 0, square = 0;  // the largest coordinate of a corner, and square of a vertex
  };
  std::vector<OfThread> of_threads(static_cast<std::size_t>(pool.size()));
  const auto measure = [&]<class Real>(const Real* all) {
    const Real* x = all + 3 * std::size_t{first_vertex};
    parallel_for(pool, of.size(), 256, [&](std::size_t begin, std::size_t end, int thread) {
      if (exceeded.load(std::memory_order_relaxed)) return;
      OfThread& here = of_threads[static_cast<std::size_t>(thread)];
      Squares all;
      double corner = here.corner, square = here.square;
      for (std::size_t c = begin; c < end; ++c) {
        const auto [i, j, k] = p.faces[c];
        const Vec x0 = position(x, i), x1 = position(x, j), x2 = position(x, k);
        const double size = std::max({largest_of(x0), largest_of(x1), largest_of(x2)});
        corner = std::max(corner, size), all.sum += size;
        for (std::size_t e = p.first_edge[c]; e < p.first_edge[c + 1]; ++e)
          of_edges[e] = square_of_edge(p.edges[e], p.crossings[e], x, all);
        const SquaresOfFace found = squares_of_face(x0, x1 - x0, x2 - x0, p.vertices[c], p.points[c], x, all);
        of[c] = found.of_all, square = std::max(square, found.of_vertices);
      }
      here.corner = corner, here.square = square;
      if (!(all.sum <= most_unchecked)) huge.store(true, std::memory_order_relaxed);
      if (std::sqrt(all.most) > most) exceeded.store(true, std::memory_order_relaxed);
    });
  };
  vertices.is_double ? measure(static_cast<const double*>(vertices.data))
                     : measure(static_cast<const float*>(vertices.data));
  if (!largest) {
    // Each vertex is a corner of a coarse face, or mapped to one: its coordinates are at most those of the corners,
    // plus its own distance.
    double corner = 0, square = 0;
    for (const OfThread& t : of_threads) corner = std::max(corner, t.corner), square = std::max(square, t.square);
    if (huge || !(corner <= most_coordinate_unchecked)) return std::nullopt;
    largest = (corner + std::sqrt(square) + 0x1p-536) * (1 + 64 * 0x1p-53);
  }
  for (std::size_t c = 0; c < of.size(); ++c)
    for (const std::uint32_t e : p.crossed[c]) of[c] = std::max(of[c], of_edges[e]);
  for (std::size_t c = 0; c < of.size(); ++c)
    if (!p.vertices[c].empty() || !p.points[c].empty() || !p.crossed[c].empty()) of[c] = bound_of(of[c], *largest);
  return of;
}

CoarseFeatures::CoarseFeatures(std::span<const Face> faces, std::size_t n_vertices)
    : faces_(faces.begin(), faces.end()), first_(n_vertices + 1, 0) {
  std::vector<Edge> edges;
  for (const Face& f : faces)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [a, b] = std::minmax(f[k], f[(k + 1) % 3]);
      edges.push_back({a, b});
    }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  for (const auto& [a, b] : edges) ++first_[a + 1], upper_.push_back(b);
  for (std::size_t v = 0; v < n_vertices; ++v) first_[v + 1] += first_[v];
  for (const Face& f : faces) edges_of_face_.push_back({edge(f[0], f[1]), edge(f[1], f[2]), edge(f[2], f[0])});
}

// The number of all edges if it is in no face.
std::uint32_t CoarseFeatures::edge(std::uint32_t a, std::uint32_t b) const {
  const std::uint32_t low = std::min(a, b), high = std::max(a, b);
  for (std::uint32_t e = first_[low]; e < first_[low + 1]; ++e)
    if (upper_[e] == high) return e;
  return static_cast<std::uint32_t>(upper_.size());
}

std::vector<double> CoarseFeatures::bounds(std::span<const std::array<std::uint32_t, 2>> vf,
                                           std::span<const std::array<std::uint32_t, 4>> ee,
                                           std::span<const double> of_faces) const {
  std::vector<double> of, of_vertices(vf.empty() ? 0 : first_.size(), 0),
      of_edges(ee.empty() ? 0 : upper_.size() + 1, 0);
  const auto raise = [](double& to, double by) { to = std::max(to, by); };
  for (std::size_t c = 0; !vf.empty() && c < faces_.size(); ++c)
    for (const std::uint32_t v : faces_[c]) raise(of_vertices[v], of_faces[c]);
  for (std::size_t c = 0; !ee.empty() && c < faces_.size(); ++c)
    for (const std::uint32_t e : edges_of_face_[c]) raise(of_edges[e], of_faces[c]);
  const auto add = [&](double sum) { of.push_back(sum > 0 ? std::nextafter(sum, INFINITY) : 0); };
  of.reserve(vf.size() + ee.size());
  for (const auto& [v, face] : vf) add(of_vertices[v] + of_faces[face]);
  for (const auto& [a, b, c, d] : ee) add(of_edges[edge(a, b)] + of_edges[edge(c, d)]);
  return of;
}

NeighbourPairs neighbour_pairs(std::span<const Face> faces, const Patches& p, std::span<const Edge> lone_edges,
                               std::size_t n_vertices, ThreadPool& pool) {
  check("faces", faces, n_vertices);
  // Cells: the coarse faces, then the lone edges.
  const std::size_t n_faces = p.faces.size(), n_cells = n_faces + lone_edges.size();
  const auto corners_of = [&](std::size_t cell) -> std::span<const std::uint32_t> {
    return cell < n_faces ? std::span<const std::uint32_t>(p.faces[cell])
                          : std::span<const std::uint32_t>(lone_edges[cell - n_faces]);
  };
  const Rows corners(n_cells, pool, [&](std::size_t cell, std::vector<std::uint32_t>& row) {
    row.assign(corners_of(cell).begin(), corners_of(cell).end());
  });
  const Rows held(n_cells, pool, [&](std::size_t cell, std::vector<std::uint32_t>& row) {
    if (cell >= n_faces) return row.assign(corners_of(cell).begin(), corners_of(cell).end());
    for (const std::uint32_t face : p.held[cell]) row.insert(row.end(), faces[face].begin(), faces[face].end());
  });
  const Rows with_corner = transposed(corners, n_vertices, pool), holding = transposed(held, n_vertices, pool);
  const Rows neighbours(n_cells, pool, [&](std::size_t cell, std::vector<std::uint32_t>& row) {
    for (const std::uint32_t v : corners[cell]) row.insert(row.end(), with_corner[v].begin(), with_corner[v].end());
    for (const std::uint32_t v : held[cell]) row.insert(row.end(), holding[v].begin(), holding[v].end());
  });
  // The edges of the coarse faces and the lone edges, and the cells that have each.
  std::vector<std::pair<Edge, std::uint32_t>> all;
  for (std::uint32_t cell = 0; cell < n_cells; ++cell) {
    const auto f = corners_of(cell);
    for (std::size_t k = 0; k < (f.size() == 3 ? 3 : 1); ++k) {
      const auto [low, high] = std::minmax(f[k], f[(k + 1) % f.size()]);
      if (low != high) all.push_back({{low, high}, cell});
    }
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  std::vector<Edge> edges;
  std::vector<std::uint64_t> first_cell;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (i == 0 || all[i].first != all[i - 1].first) edges.push_back(all[i].first), first_cell.push_back(i);
  first_cell.push_back(all.size());
  const Rows cells_of_edge(edges.size(), pool, [&](std::size_t e, std::vector<std::uint32_t>& row) {
    for (std::uint64_t i = first_cell[e]; i < first_cell[e + 1]; ++i) row.push_back(all[i].second);
  });
  const Rows edges_of_cell = transposed(cells_of_edge, n_cells, pool);

  // The cells that are neighbours of all these cells.
  const auto common = [&](std::span<const std::uint32_t> cells) {
    std::vector<std::uint32_t> found(neighbours[cells[0]].begin(), neighbours[cells[0]].end()), rest;
    for (const std::uint32_t cell : cells.subspan(1)) {
      rest.clear();
      std::ranges::set_intersection(found, neighbours[cell], std::back_inserter(rest));
      found.swap(rest);
    }
    return found;
  };
  const auto has = [](std::span<const std::uint32_t> row, std::uint32_t x) {
    return std::ranges::find(row, x) != row.end();
  };
  const Rows faces_of_vertex(n_vertices, pool, [&](std::size_t v, std::vector<std::uint32_t>& row) {
    if (with_corner[v].empty()) return;
    for (const std::uint32_t c : common(with_corner[v]))
      if (c < n_faces && !has(corners[c], static_cast<std::uint32_t>(v))) row.push_back(c);
  });
  const Rows faces_of_edge(edges.size(), pool, [&](std::size_t e, std::vector<std::uint32_t>& row) {
    for (const std::uint32_t c : common(cells_of_edge[e]))
      if (c < n_faces && !has(corners[c], edges[e][0]) && !has(corners[c], edges[e][1])) row.push_back(c);
  });
  const Rows edges_of_edge(edges.size(), pool, [&](std::size_t e, std::vector<std::uint32_t>& row) {
    const std::vector<std::uint32_t> near = common(cells_of_edge[e]);
    for (const std::uint32_t c : near)
      for (const std::uint32_t other : edges_of_cell[c])
        if (other > e && !has(edges[other], edges[e][0]) && !has(edges[other], edges[e][1]) &&
            std::ranges::includes(near, cells_of_edge[other]))
          row.push_back(other);
  });
  NeighbourPairs pairs;
  for (std::uint32_t v = 0; v < n_vertices; ++v)
    for (const std::uint32_t c : faces_of_vertex[v]) pairs.vf.push_back({v, c});
  for (std::uint32_t e = 0; e < edges.size(); ++e) {
    for (const std::uint32_t other : edges_of_edge[e])
      pairs.ee.push_back({edges[e][0], edges[e][1], edges[other][0], edges[other][1]});
    for (const std::uint32_t c : faces_of_edge[e]) pairs.ef.push_back({edges[e][0], edges[e][1], c});
  }
  return pairs;
}

}  // namespace hpccd::detail
