// SPDX-License-Identifier: Apache-2.0
#include "contacts/contours.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <string>
#include <utility>

#include "elementary/exact/intersection.h"
#include "hpccd/errors.h"
#include "scene/face_adjacency.h"

namespace hpccd {
namespace {

using EdgeFaceRow = std::array<std::uint32_t, 3>;
using Corners = std::array<std::uint32_t, 3>;
using exact::IntersectionPlace;

constexpr std::uint32_t none = ~std::uint32_t{0};

// A vertex, an edge or a face: the smallest one of a mesh that contains a point. Sorted vertices, then `none`.
using Simplex = std::array<std::uint32_t, 3>;

Simplex simplex_of_edge(const EdgeFaceRow& row, std::uint8_t incidence) {
  if (incidence & IntersectionPlace::at_start) return {row[0], none, none};
  if (incidence & IntersectionPlace::at_end) return {row[1], none, none};
  return {row[0], row[1], none};
}
Simplex simplex_of_face(const Corners& face, std::uint8_t incidence) {
  Simplex s{none, none, none};
  int n = 0;
  for (int i = 0; i < 3; ++i)
    if (!(incidence & IntersectionPlace::without_corner << i)) s[n++] = face[i];
  std::ranges::sort(s);
  return s;
}
bool has(const Corners& face, std::uint32_t vertex) { return std::ranges::find(face, vertex) != face.end(); }
bool contains(const Corners& face, const Simplex& s) {
  return std::ranges::all_of(s, [&](std::uint32_t v) { return v == none || has(face, v); });
}
std::uint32_t common_vertex(const Corners& f, const Corners& g) {
  for (const std::uint32_t v : f)
    if (has(g, v)) return v;
  return none;
}

using FacePair = std::array<std::uint32_t, 2>;  // ascending

// Rows that have the same point are one node, named by the first of them. A pair of triangles that intersect in a
// segment has a node at each end of it, except at a vertex that both share: it links them.
class CurveGraph {
 public:
  struct Link {
    std::uint32_t to;
    FacePair pair;
    auto operator<=>(const Link&) const = default;
  };

  CurveGraph(const IntersectionRows& rows, const FaceAdjacency& adjacency) : rows_(rows), adjacency_(adjacency) {
    join_rows();
    link();
  }

  std::uint32_t n_rows() const { return static_cast<std::uint32_t>(rows_.ef.size()); }
  bool is_node(std::uint32_t row) const { return node_.empty() || node_[row] == row; }
  std::span<const Link> links(std::uint32_t node) const {
    return std::span(links_).subspan(first_[node], last_[node] - first_[node]);
  }
  // Calls use(row) for each row of the node, in ascending order.
  template <class Use>
  void for_each_row(std::uint32_t node, Use&& use) const {
    if (node_.empty()) return use(node);
    const auto group = std::ranges::equal_range(grouped_, node, {}, [&](std::uint32_t row) { return node_[row]; });
    if (group.empty()) return use(node);
    for (const std::uint32_t row : group) use(row);
  }
  // Calls use(face of the edge) for the row.
  template <class Use>
  void for_each_face(std::uint32_t row, Use&& use) const {
    adjacency_.for_each_face(rows_.ef[row][0], rows_.ef[row][1], use);
  }
  const EdgeFaceRow& row(std::uint32_t i) const { return rows_.ef[i]; }
  const Corners& face(std::uint32_t i) const { return rows_.faces[i]; }
  // The features of both sides that meet in a node.
  std::array<Simplex, 2> simplices(std::uint32_t node) const {
    return {simplex_of_edge(row(node), rows_.incidences[node]),
            simplex_of_face(face(row(node)[2]), rows_.incidences[node])};
  }

 private:
  void join_rows() {
    constexpr int rounded = ~IntersectionPlace::in_plane;
    struct Place {
      std::array<std::uint32_t, 6> on;  // both simplices, the smaller one first
      std::uint32_t row;
    };
    std::vector<Place> places;
    for (std::uint32_t i = 0; i < n_rows(); ++i) {
      if (!(rows_.incidences[i] & rounded)) continue;  // no other row has this point
      auto [e, f] = simplices(i);
      if (f < e) std::swap(e, f);
      places.push_back({{e[0], e[1], e[2], f[0], f[1], f[2]}, i});
    }
    if (places.empty()) return;
    std::ranges::sort(places,
                      [](const Place& x, const Place& y) { return x.on != y.on ? x.on < y.on : x.row < y.row; });
    node_.resize(n_rows());
    for (std::uint32_t i = 0; i < n_rows(); ++i) node_[i] = i;
    for (std::size_t i = 1; i < places.size(); ++i)
      if (places[i].on == places[i - 1].on) node_[places[i].row] = node_[places[i - 1].row];
    for (const Place& place : places) grouped_.push_back(place.row);
    std::ranges::sort(grouped_, {}, [&](std::uint32_t row) { return std::pair(node_[row], row); });
  }

  std::uint32_t node_of(std::uint32_t row) const { return node_.empty() ? row : node_[row]; }

  // The nodes of one pair of triangles. Of a pair in one plane, all rows are of edges in the plane of the other.
  struct PairNodes {
    FacePair pair{none, none};
    std::uint32_t nodes[2] = {none, none};
    bool many = false, in_plane = true;
  };

  // An open-addressing table: no order of it shows in the result.
  PairNodes& at(FacePair pair) {
    const std::uint64_t key = std::uint64_t{pair[0]} << 32 | pair[1];
    for (std::size_t i = key * 0x9e3779b97f4a7c15 >> shift_;; i = (i + 1) & (table_.size() - 1)) {
      if (table_[i].pair == pair) return table_[i];
      if (table_[i].pair[0] == none) {
        table_[i].pair = pair;
        return table_[i];
      }
    }
  }

  void link() {
    std::size_t n_pairs = 0;
    for (std::uint32_t i = 0; i < n_rows(); ++i) for_each_face(i, [&](std::uint32_t) { ++n_pairs; });
    const int bits = std::bit_width(2 * n_pairs + 1);
    shift_ = 64 - bits;
    table_.resize(std::size_t{1} << bits);
    for (std::uint32_t i = 0; i < n_rows(); ++i) {
      const std::uint32_t node = node_of(i), f = row(i)[2];
      for_each_face(i, [&](std::uint32_t t) {
        PairNodes& p = at({std::min(t, f), std::max(t, f)});
        if (!(rows_.incidences[i] & IntersectionPlace::in_plane)) p.in_plane = false;
        if (p.nodes[0] == none)
          p.nodes[0] = node;
        else if (p.nodes[0] != node && p.nodes[1] == none)
          p.nodes[1] = node;
        else if (p.nodes[0] != node && p.nodes[1] != node)
          p.many = true;
      });
    }
    const auto is_link = [](const PairNodes& p) { return p.nodes[1] != none && !p.many && !p.in_plane; };
    first_.assign(std::size_t{n_rows()} + 2, 0);
    for (const PairNodes& p : table_)
      if (is_link(p)) ++first_[p.nodes[0] + 2], ++first_[p.nodes[1] + 2];
    for (std::size_t i = 2; i < first_.size(); ++i) first_[i] += first_[i - 1];
    links_.resize(first_.back());
    for (const PairNodes& p : table_)
      if (is_link(p))
        for (int k = 0; k < 2; ++k) links_[first_[p.nodes[k] + 1]++] = {p.nodes[1 - k], p.pair};
    table_ = {};
    // Of several pairs with the same segment the first remains.
    last_.resize(n_rows());
    for (std::uint32_t i = 0; i < n_rows(); ++i) {
      const auto begin = links_.begin() + first_[i], end = links_.begin() + first_[i + 1];
      std::sort(begin, end);
      const auto unique_end = std::unique(begin, end, [](const Link& x, const Link& y) { return x.to == y.to; });
      last_[i] = static_cast<std::uint32_t>(unique_end - links_.begin());
    }
  }

  const IntersectionRows& rows_;
  const FaceAdjacency& adjacency_;
  std::vector<std::uint32_t> node_,
      grouped_;  // node of each row; rows that may share a point, by node. Empty: none may
  std::vector<PairNodes> table_;
  int shift_ = 0;
  std::vector<std::uint32_t> first_, last_;
  std::vector<Link> links_;
};

// A polyline of nodes. pairs[i] has the segment from node i to the next; the last of a closed one to the first.
struct Curve {
  std::vector<std::uint32_t> nodes;
  std::vector<FacePair> pairs;
  bool closed = false;

  std::uint32_t first_row() const { return std::ranges::min(nodes); }
};

class Tracer {
 public:
  explicit Tracer(const CurveGraph& graph) : graph_(graph), taken_(graph.n_rows(), false) {}

  std::vector<Curve> curves() {
    std::vector<Curve> found;
    for (std::uint32_t i = 0; i < graph_.n_rows(); ++i)
      if (graph_.is_node(i) && !taken_[i] && !is_junction(i)) found.push_back(curve_through(i));
    for (std::uint32_t i = 0; i < graph_.n_rows(); ++i)
      if (graph_.is_node(i) && !taken_[i]) found.push_back({{i}, {}, false});
    std::ranges::stable_sort(found, {}, &Curve::first_row);
    return found;
  }

 private:
  bool is_junction(std::uint32_t node) const { return graph_.links(node).size() > 2; }

  // The node is the smallest one of those that are left of its curve, junctions apart.
  Curve curve_through(std::uint32_t node) {
    taken_[node] = true;
    const auto links = graph_.links(node);
    Curve curve;
    if (!links.empty()) walk(node, links[0], curve);
    if (curve.closed || links.size() < 2) {
      curve.nodes.insert(curve.nodes.begin(), node);
      return orient(std::move(curve));
    }
    std::ranges::reverse(curve.nodes), std::ranges::reverse(curve.pairs);
    curve.nodes.push_back(node);
    walk(node, links[1], curve);
    return orient(std::move(curve));
  }

  // Appends what follows the node along the link. A free junction ends it, as its last node.
  void walk(std::uint32_t from, CurveGraph::Link link, Curve& curve) {
    const std::uint32_t start = from;
    for (;;) {
      if (link.to == start) {
        curve.closed = true;
        curve.pairs.push_back(link.pair);
        return;
      }
      if (taken_[link.to]) {
        // Back at the junction where the curve has begun.
        if (!curve.nodes.empty() && link.to == curve.nodes.front() && is_junction(link.to))
          curve.closed = true, curve.pairs.push_back(link.pair);
        return;
      }
      taken_[link.to] = true;
      curve.nodes.push_back(link.to), curve.pairs.push_back(link.pair);
      const auto links = graph_.links(link.to);
      if (links.size() != 2) return;
      const std::uint32_t at = link.to;
      link = links[links[0].to == from ? 1 : 0];
      from = at;
    }
  }

  // A closed curve begins with its smallest row, an open one at the end with the smaller row.
  static Curve orient(Curve curve) {
    if (!curve.closed) {
      if (curve.nodes.back() < curve.nodes.front())
        std::ranges::reverse(curve.nodes), std::ranges::reverse(curve.pairs);
      return curve;
    }
    const auto begin = std::ranges::min_element(curve.nodes) - curve.nodes.begin();
    std::ranges::rotate(curve.nodes, curve.nodes.begin() + begin);
    std::ranges::rotate(curve.pairs, curve.pairs.begin() + begin);
    if (curve.nodes.back() < curve.nodes[1])
      std::reverse(curve.nodes.begin() + 1, curve.nodes.end()), std::ranges::reverse(curve.pairs);
    return curve;
  }

  const CurveGraph& graph_;
  std::vector<bool> taken_;
};

std::uint32_t mesh_of(const IntersectionRows& rows, std::uint32_t vertex) {
  return static_cast<std::uint32_t>(std::ranges::upper_bound(rows.first_vertex, vertex) - rows.first_vertex.begin() -
                                    1);
}

// Meshes of both sides of a curve.
std::array<std::uint32_t, 2> meshes_of(const IntersectionRows& rows, const Curve& curve) {
  const EdgeFaceRow& row = rows.ef[curve.nodes[0]];
  const std::uint32_t a = mesh_of(rows, row[0]), b = mesh_of(rows, rows.faces[row[2]][0]);
  return {std::min(a, b), std::max(a, b)};
}

// What a curve cuts on one side: edges that it crosses, vertices that it passes through.
struct Cut {
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<std::uint32_t> vertices;

  void add(const Simplex& s) {
    if (s[1] == none)
      vertices.push_back(s[0]);
    else if (s[2] == none)
      edges.push_back({s[0], s[1]});
  }
  void add(const Cut& other) {
    edges.insert(edges.end(), other.edges.begin(), other.edges.end());
    vertices.insert(vertices.end(), other.vertices.begin(), other.vertices.end());
  }
};

// Finds on which side of a curve each of the features is that it passes.
class CurveSides {
 public:
  CurveSides(const IntersectionRows& rows, const CurveGraph& graph, const Curve& curve)
      : rows_(rows), graph_(graph), curve_(curve), meshes_(meshes_of(rows, curve)) {
    for (const FacePair& pair : curve.pairs) ordered_.push_back(ordered(pair));
    for (std::size_t i = 0; i < curve.nodes.size(); ++i) cut(i);
    if (meshes_[0] != meshes_[1]) return;
    if (curve.closed)
      one_loop_ = follows(ordered_.back(), ordered_.front()) < follows(ordered_.back(), swapped(ordered_.front()));
    else if (!curve.pairs.empty())
      one_loop_ = ends_in_vertex(curve.nodes.front(), curve.pairs.front()) &&
                  ends_in_vertex(curve.nodes.back(), curve.pairs.back());
    if (one_loop_) cuts_[0].add(cuts_[1]), cuts_[1] = cuts_[0];
  }

  bool enclose() const { return curve_.closed || one_loop_; }
  const Cut& of(int side) const { return cuts_[side]; }
  // Whether both sides lie on one loop, which encloses one region of the mesh.
  bool one_loop() const { return one_loop_; }

 private:
  static FacePair swapped(const FacePair& p) { return {p[1], p[0]}; }

  int shared(std::uint32_t f, std::uint32_t g) const {
    return static_cast<int>(std::ranges::count_if(graph_.face(f), [&](auto v) { return has(graph_.face(g), v); }));
  }
  // How well a pair continues another: 3 for a triangle that remains, 2 for a step across an edge.
  int follows(const FacePair& before, const FacePair& after) const {
    return shared(before[0], after[0]) + shared(before[1], after[1]);
  }
  FacePair ordered(const FacePair& pair) const {
    if (meshes_[0] != meshes_[1]) return mesh_of(rows_, graph_.face(pair[0])[0]) == meshes_[0] ? pair : swapped(pair);
    if (ordered_.empty()) return pair;
    return follows(ordered_.back(), swapped(pair)) > follows(ordered_.back(), pair) ? swapped(pair) : pair;
  }

  void cut(std::size_t i) {
    const auto [edge, face] = graph_.simplices(curve_.nodes[i]);
    // In the order of the pairs beside the node.
    const std::size_t n = ordered_.size();
    int edge_first = 0;
    const auto see = [&](const FacePair& p) {
      edge_first += contains(graph_.face(p[0]), edge) && contains(graph_.face(p[1]), face);
      edge_first -= contains(graph_.face(p[1]), edge) && contains(graph_.face(p[0]), face);
    };
    if (i < n) see(ordered_[i]);
    if (i > 0)
      see(ordered_[i - 1]);
    else if (curve_.closed)
      see(ordered_[n - 1]);
    cuts_[edge_first < 0].add(edge), cuts_[edge_first >= 0].add(face);
  }

  // Whether the curve goes on from the node, in another pair than the given one, to a vertex that both triangles share.
  bool ends_in_vertex(std::uint32_t node, const FacePair& from) {
    std::uint32_t end = none;
    graph_.for_each_row(node, [&](std::uint32_t i) {
      const std::uint32_t f = graph_.row(i)[2];
      graph_.for_each_face(i, [&](std::uint32_t t) {
        if (FacePair{std::min(t, f), std::max(t, f)} == from) return;
        if (const std::uint32_t v = common_vertex(graph_.face(t), graph_.face(f)); v != none) end = v;
      });
    });
    if (end != none) cuts_[0].vertices.push_back(end);
    return end != none;
  }

  const IntersectionRows& rows_;
  const CurveGraph& graph_;
  const Curve& curve_;
  std::array<std::uint32_t, 2> meshes_;
  std::vector<FacePair> ordered_;  // the triangle on side 0, then that on side 1
  std::array<Cut, 2> cuts_;
  bool one_loop_ = false;
};

// Vertices beyond a cut, by growing both parts in turn until the smaller one is complete.
class FloodFill {
 public:
  FloodFill(std::span<const Corners> faces, const FaceAdjacency& adjacency, std::size_t n_vertices)
      : faces_(faces), adjacency_(adjacency), label_(n_vertices, 0) {}

  std::vector<std::uint32_t> smaller_part(Cut cut) {
    // An edge that is crossed twice has both ends in one part.
    std::ranges::sort(cut.edges);
    std::vector<std::array<std::uint32_t, 2>> crossed;
    for (const auto& e : cut.edges)
      if (!crossed.empty() && crossed.back() == e)
        crossed.pop_back();
      else
        crossed.push_back(e);
    ++calls_;
    for (const std::uint32_t v : cut.vertices) label_[v] = name(on_curve);
    const auto begin = std::ranges::find_if(
        crossed, [&](const auto& e) { return label_[e[0]] != name(on_curve) && label_[e[1]] != name(on_curve); });
    if (begin == crossed.end()) return smaller_part_beside(cut.vertices);
    std::array<std::vector<std::uint32_t>, 2> parts;
    std::array<std::size_t, 2> next{0, 0};
    for (int k = 0; k < 2; ++k) parts[k].push_back((*begin)[k]), label_[(*begin)[k]] = name(first + k);
    for (int k = 0;; k = 1 - k) {
      if (next[k] == parts[k].size()) {
        std::ranges::sort(parts[k]);
        return parts[k];
      }
      const std::uint32_t v = parts[k][next[k]++];
      for (const std::uint32_t f : adjacency_.faces_of(v))
        for (const std::uint32_t w : faces_[f]) {
          if (label_[w] == name(first + k) || label_[w] == name(on_curve)) continue;
          if (std::ranges::binary_search(crossed, std::array{std::min(v, w), std::max(v, w)})) continue;
          if (label_[w] == name(first + 1 - k)) return {};  // the curve does not divide the mesh
          label_[w] = name(first + k);
          parts[k].push_back(w);
        }
    }
  }

 private:
  // Of a curve along edges and through vertices only: of the parts beside its vertices, if there are two.
  std::vector<std::uint32_t> smaller_part_beside(const std::vector<std::uint32_t>& on) {
    std::vector<std::vector<std::uint32_t>> parts;
    for (const std::uint32_t v : on)
      for (const std::uint32_t f : adjacency_.faces_of(v))
        for (const std::uint32_t start : faces_[f]) {
          if (label_[start] >= name(on_curve)) continue;
          if (parts.size() == 2) return {};
          auto& part = parts.emplace_back(1, start);
          label_[start] = name(first);
          for (std::size_t i = 0; i < part.size(); ++i)
            for (const std::uint32_t g : adjacency_.faces_of(part[i]))
              for (const std::uint32_t w : faces_[g])
                if (label_[w] < name(on_curve)) label_[w] = name(first), part.push_back(w);
        }
    if (parts.size() < 2) return {};
    auto& smaller = parts[parts[1].size() < parts[0].size()];
    std::ranges::sort(smaller);
    return std::move(smaller);
  }

  enum { on_curve, first };
  std::uint64_t name(int of) const { return 3 * calls_ + static_cast<std::uint64_t>(of); }

  std::span<const Corners> faces_;
  const FaceAdjacency& adjacency_;
  std::vector<std::uint64_t> label_;
  std::uint64_t calls_ = 0;
};

// The arrays of a public result, checked.
struct CheckedRows {
  std::vector<std::int64_t> first_vertex;
  IntersectionRows rows;

  CheckedRows(const Scene& scene, const Intersections& found) {
    for (const auto& mesh : scene.meshes()) first_vertex.push_back(mesh.first_vertex);
    first_vertex.push_back(scene.n_vertices());
    rows = {found.ef, found.incidences, scene.faces(), first_vertex};
  }
};

void check_rows(const IntersectionRows& rows) {
  if (rows.incidences.size() != rows.ef.size())
    throw InvalidArgument("found: has no points; make the detector with Options::points");
  if (rows.ef.size() >= none) throw InvalidArgument("found: has more than 2^32 - 2 rows; use fewer");
  const auto n_vertices = static_cast<std::uint64_t>(rows.first_vertex.empty() ? 0 : rows.first_vertex.back());
  for (const EdgeFaceRow& row : rows.ef)
    if (row[0] >= n_vertices || row[1] >= n_vertices || row[2] >= rows.faces.size())
      throw InvalidArgument("found: has a vertex or a face that is not in the scene; give the detector's scene");
}

struct Traced {
  FaceAdjacency adjacency;
  CurveGraph graph;
  std::vector<Curve> curves;

  explicit Traced(const IntersectionRows& rows)
      : adjacency(rows.faces, static_cast<std::size_t>(rows.first_vertex.back())),
        graph(rows, adjacency),
        curves(Tracer(graph).curves()) {}
};

}  // namespace

std::vector<Contour> contours_of(const IntersectionRows& rows) {
  check_rows(rows);
  if (rows.ef.empty()) return {};
  const Traced traced(rows);
  std::vector<Contour> found;
  found.reserve(traced.curves.size());
  for (const Curve& curve : traced.curves) {
    const auto [a, b] = meshes_of(rows, curve);
    Contour& contour = found.emplace_back(Contour{{}, curve.closed, a, b});
    contour.rows.reserve(curve.nodes.size());
    for (const std::uint32_t node : curve.nodes)
      traced.graph.for_each_row(node, [&](std::uint32_t row) { contour.rows.push_back(row); });
  }
  return found;
}

std::vector<EnclosedRegion> enclosed_regions_of(const IntersectionRows& rows) {
  check_rows(rows);
  if (rows.ef.empty()) return {};
  const Traced traced(rows);
  FloodFill flood(rows.faces, traced.adjacency, static_cast<std::size_t>(rows.first_vertex.back()));
  std::vector<EnclosedRegion> found;
  found.reserve(traced.curves.size());
  for (const Curve& curve : traced.curves) {
    EnclosedRegion& region = found.emplace_back();
    const CurveSides sides(rows, traced.graph, curve);
    if (!sides.enclose()) continue;
    region.vertices_a = flood.smaller_part(sides.of(0));
    region.vertices_b = sides.one_loop() ? region.vertices_a : flood.smaller_part(sides.of(1));
  }
  return found;
}

}  // namespace hpccd

// Outside of the namespace: inside, a declaration of the inline namespace would be declared again.
std::vector<hpccd::Contour> hpccd::contours(const Scene& scene, const Intersections& found) {
  return contours_of(CheckedRows(scene, found).rows);
}

std::vector<hpccd::EnclosedRegion> hpccd::enclosed_regions(const Scene& scene, const Intersections& found) {
  return enclosed_regions_of(CheckedRows(scene, found).rows);
}
