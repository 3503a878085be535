// SPDX-License-Identifier: Apache-2.0
#include "scene/feature_filter.h"

#include <algorithm>
#include <atomic>
#include <iterator>
#include <numeric>
#include <span>
#include <string>

#include "scene/face_adjacency.h"
#include "scene/scene_pairs.h"

namespace hpccd {
namespace {

using Pairs = std::vector<std::array<std::uint32_t, 2>>;
using Rows = FeatureFilter::Rows;

void require_room(std::uint64_t n, const char* name) {
  if (n > UINT32_MAX)
    throw InvalidArgument(
        std::string(name) +
        ": ignores 2^32 pairs or more; give fewer rings or a smaller distance, or add the mesh without self-collision");
}

// The number of each row to the position at which it begins.
void sum_up(std::vector<std::uint32_t>& first) { std::partial_sum(first.begin(), first.end(), first.begin()); }

// By a counting sort: with rest filters most pairs are found several times, 10^8 for a cloth of 125,000 faces.
Rows rows_of(Pairs pairs, std::size_t n_rows, const char* name) {
  Rows rows;
  if (pairs.empty()) return rows;
  std::vector<std::size_t> end(n_rows + 1, 0);
  for (const auto& [row, value] : pairs) ++end[row + 1];
  std::partial_sum(end.begin(), end.end(), end.begin());
  rows.values.resize(pairs.size());
  for (const auto& [row, value] : pairs) rows.values[end[row]++] = value;  // now the end of the row
  pairs = {};
  rows.first.assign(n_rows + 1, 0);
  auto kept = rows.values.begin(), begin = kept;
  for (std::size_t row = 0; row < n_rows; ++row) {
    const auto last = rows.values.begin() + static_cast<std::ptrdiff_t>(end[row]);
    std::sort(begin, last);
    const auto different = std::unique(begin, last);
    kept = kept == begin ? different : std::move(begin, different, kept);
    begin = last;
    const auto n = static_cast<std::size_t>(kept - rows.values.begin());
    require_room(n, name);
    rows.first[row + 1] = static_cast<std::uint32_t>(n);
  }
  rows.values.erase(kept, rows.values.end());
  rows.values.shrink_to_fit();
  return rows;
}

// The vertices at the other end of the edges of each vertex.
class Neighbours {
 public:
  explicit Neighbours(const Features& x)
      : n_(x.n_vertices), first_(x.n_vertices + std::size_t{2}, 0), other_(2 * x.edges.size()) {
    for (const auto& edge : x.edges)
      for (const std::uint32_t v : edge) ++first_[v + std::size_t{2}];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    for (const auto& [v, w] : x.edges) other_[first_[v + 1]++] = w, other_[first_[w + 1]++] = v;
  }
  std::span<const std::uint32_t> of(std::uint32_t v) const {
    return std::span(other_).subspan(first_[v], first_[v + 1] - first_[v]);
  }
  std::size_t n() const { return n_; }

 private:
  std::size_t n_;
  std::vector<std::size_t> first_;
  std::vector<std::uint32_t> other_;
};

// Vertices within some edges of another.
class Ball {
 public:
  // Those of v by distance, v first, which are valid until the next call.
  std::vector<std::uint32_t>& around(std::uint32_t v, std::uint32_t rings, const Neighbours& neighbours) {
    if (last_.empty()) last_.assign(neighbours.n(), UINT32_MAX);
    reached_.assign(1, v), last_[v] = v;
    rings_ = 0;
    for (std::size_t from = 0; rings_ < rings && from < reached_.size(); ++rings_)
      for (const std::size_t end = reached_.size(); from < end; ++from)
        for (const std::uint32_t w : neighbours.of(reached_[from]))
          if (last_[w] != v) last_[w] = v, reached_.push_back(w);
    return reached_;
  }
  // At least the number of rings that the last ones lie in.
  std::uint32_t rings() const { return rings_; }

 private:
  std::vector<std::uint32_t> last_;  // by vertex: around which it was reached last
  std::vector<std::uint32_t> reached_;
  std::uint32_t rings_ = 0;
};

// The number of pairs in components whose vertices are all within the rings of each other: known before they are
// listed, which would take hours and all memory.
std::uint64_t pairs_of_whole_components(const Features& x, const std::vector<std::uint32_t>& rings,
                                        const Neighbours& neighbours) {
  Ball ball;
  std::vector<char> seen(x.n_vertices);
  std::uint64_t n = 0;
  for (std::uint32_t v = 0; v < x.n_vertices; ++v) {
    const std::uint32_t most = rings[x.mesh_of_vertex[v]];
    if (most == 0 || seen[v]) continue;
    const std::vector<std::uint32_t>& component = ball.around(v, UINT32_MAX, neighbours);
    for (const std::uint32_t w : component) seen[w] = true;
    if (2 * std::uint64_t{ball.rings()} <= most) n += std::uint64_t{component.size()} * (component.size() - 1) / 2;
  }
  return n;
}

// By breadth-first search from each vertex. Only vertices with higher numbers are kept: half of the memory.
Rows rows_of_rings(const Scene& scene, const Features& x, ThreadPool& pool) {
  std::vector<std::uint32_t> rings(scene.meshes().size(), 0);
  for (const auto& [mesh, n] : ScenePairs(scene).rings())
    if (scene.pair_enabled(mesh, mesh)) rings[mesh] = n;
  if (std::ranges::count(rings, 0u) == std::ssize(rings)) return {};
  const Neighbours neighbours(x);
  require_room(pairs_of_whole_components(x, rings, neighbours), "rings");
  constexpr std::size_t piece = 1024;
  std::vector<std::vector<std::uint32_t>> found((x.n_vertices + piece - 1) / piece);
  std::vector<Ball> balls(static_cast<std::size_t>(pool.size()));
  std::atomic<std::uint64_t> n{0};
  Rows rows;
  rows.first.assign(x.n_vertices + std::size_t{1}, 0);
  parallel_for(pool, x.n_vertices, piece, [&](std::size_t begin, std::size_t end, int thread) {
    std::vector<std::uint32_t>& values = found[begin / piece];
    for (auto v = static_cast<std::uint32_t>(begin); v < end; ++v) {
      const std::uint32_t most = rings[x.mesh_of_vertex[v]];
      if (most == 0) continue;
      auto& near = balls[static_cast<std::size_t>(thread)].around(v, most, neighbours);
      std::erase_if(near, [&](std::uint32_t w) { return w <= v; });
      std::ranges::sort(near);
      require_room(n += near.size(), "rings");
      rows.first[v + std::size_t{1}] = static_cast<std::uint32_t>(near.size());
      values.insert(values.end(), near.begin(), near.end());
    }
  });
  sum_up(rows.first);
  rows.values.reserve(n);
  for (auto& values : found) rows.values.insert(rows.values.end(), values.begin(), values.end()), values = {};
  return rows;
}

std::uint32_t number_of_edge(const Features& x, std::uint32_t v, std::uint32_t w, const char* name, std::size_t row) {
  const std::array edge{std::min(v, w), std::max(v, w)};
  const auto at = std::ranges::lower_bound(x.edges, edge);
  if (at == x.edges.end() || *at != edge)
    throw InvalidArgument(std::string(name) + "[" + std::to_string(row) + "]: the vertices " + std::to_string(v) +
                          " and " + std::to_string(w) + " are not joined by an edge; give the vertices of an edge");
  return static_cast<std::uint32_t>(at - x.edges.begin());
}

// Pairs of meshes whose features are ignored as a whole, by ignore_faces.
struct IgnoredAgainst {
  Pairs vertices, edges, faces;  // feature, mesh

  IgnoredAgainst(const Scene& scene, const Features& x) {
    const auto& given = ScenePairs(scene).ignored_faces();
    if (given.empty()) return;
    const FaceAdjacency adjacency(x.faces, x.n_vertices);
    std::vector<char> ignored(x.n_faces());
    for (const auto& [meshes, numbers] : given) {
      const Scene::Mesh& mesh = scene.meshes()[meshes.first];
      for (const std::uint32_t i : numbers) ignored[mesh.first_face + i] = true;
      const auto all_ignored = [&](auto&& each_face) {
        bool all = true;
        each_face([&](std::uint32_t face) { all = all && ignored[face]; });
        return all;
      };
      for (const std::uint32_t i : numbers) {
        const std::uint32_t face = mesh.first_face + i;
        faces.push_back({face, meshes.second});
        const auto& f = x.faces[face];
        for (int k = 0; k < 3; ++k) {
          const std::uint32_t v = f[k], w = f[(k + 1) % 3];
          if (all_ignored([&](auto&& use) { std::ranges::for_each(adjacency.faces_of(v), use); }))
            vertices.push_back({v, meshes.second});
          if (v != w && all_ignored([&](auto&& use) { adjacency.for_each_face(v, w, use); }))
            edges.push_back({number_of_edge(x, v, w, "faces", i), meshes.second});
        }
      }
      for (const std::uint32_t i : numbers) ignored[mesh.first_face + i] = false;
    }
  }
};

}  // namespace

FeatureFilter::FeatureFilter(const Scene& scene, const Features& x, FeaturePairs pairs, ThreadPool& pool) {
  const ScenePairs given(scene);
  pairs.vf.insert(pairs.vf.end(), given.ignored_vf().begin(), given.ignored_vf().end());
  const auto edge = [&](std::uint32_t v, std::uint32_t w, const char* name, std::size_t row) {
    return number_of_edge(x, v, w, name, row);
  };
  for (std::size_t i = 0; i < given.ignored_ee().size(); ++i) {
    const auto& [a0, a1, b0, b1] = given.ignored_ee()[i];
    pairs.ee.push_back({edge(a0, a1, "ee", i), edge(b0, b1, "ee", i)});
  }
  for (std::size_t i = 0; i < given.ignored_ef().size(); ++i) {
    const auto& [v, w, face] = given.ignored_ef()[i];
    pairs.ef.push_back({edge(v, w, "ef", i), face});
  }
  for (auto& [a, b] : pairs.ee)
    if (a > b) std::swap(a, b);
  IgnoredAgainst against(scene, x);
  constexpr const char *pairs_name = "distance", *faces_name = "faces";
  rows_[near] = rows_of_rings(scene, x, pool);
  rows_[vf] = rows_of(std::move(pairs.vf), x.n_vertices, pairs_name);
  rows_[ee] = rows_of(std::move(pairs.ee), x.edges.size(), pairs_name);
  rows_[ef] = rows_of(std::move(pairs.ef), x.edges.size(), pairs_name);
  rows_[vertex_against] = rows_of(std::move(against.vertices), x.n_vertices, faces_name);
  rows_[edge_against] = rows_of(std::move(against.edges), x.edges.size(), faces_name);
  rows_[face_against] = rows_of(std::move(against.faces), x.n_faces(), faces_name);
  any_ = std::ranges::any_of(rows_, [](const Rows& rows) { return !rows.first.empty(); });
  view_ = {x.edges.empty() ? nullptr : x.edges[0].data(),
           x.faces.empty() ? nullptr : x.faces[0].data(),
           x.mesh_of_vertex.data(),
           rows_[near].view(),
           rows_[vf].view(),
           rows_[ee].view(),
           rows_[ef].view(),
           rows_[vertex_against].view(),
           rows_[edge_against].view(),
           rows_[face_against].view()};
}

std::size_t FeatureFilter::bytes() const {
  return std::accumulate(rows_.begin(), rows_.end(), std::size_t{0},
                         [](std::size_t n, const Rows& rows) { return n + rows.bytes(); });
}

std::array<std::uint32_t, 2> edges_of_mesh(const Features& features, const Scene::Mesh& mesh) {
  const auto first = [&](std::uint32_t vertex) {
    const std::array least{vertex, 0u};
    return static_cast<std::uint32_t>(std::ranges::lower_bound(features.edges, least) - features.edges.begin());
  };
  return {first(mesh.first_vertex), first(mesh.first_vertex + mesh.n_vertices)};
}

std::vector<std::array<std::uint32_t, 2>> filtered_pairs(const Scene& scene) {
  const ScenePairs given(scene);
  Pairs pairs;
  for (const auto& [mesh, rings] : given.rings())
    if (rings > 0) pairs.push_back({mesh, mesh});
  for (const auto& [mesh, filters] : given.rest()) pairs.push_back({mesh, mesh});
  for (const auto& [meshes, faces] : given.ignored_faces())
    if (!faces.empty()) pairs.push_back({meshes.first, meshes.second});
  const auto& meshes = scene.meshes();
  const auto mesh_of = [&](std::uint32_t number, std::uint32_t Scene::Mesh::* first, std::uint32_t Scene::Mesh::* n) {
    // The last mesh that begins at or before it and has any.
    auto at = std::ranges::upper_bound(meshes, number, {}, first);
    do --at;
    while ((*at).*n == 0);
    return static_cast<std::uint32_t>(at - meshes.begin());
  };
  const auto add = [&](std::uint32_t vertex, std::uint32_t other, bool is_face) {
    const std::array pair{mesh_of(vertex, &Scene::Mesh::first_vertex, &Scene::Mesh::n_vertices),
                          is_face ? mesh_of(other, &Scene::Mesh::first_face, &Scene::Mesh::n_faces)
                                  : mesh_of(other, &Scene::Mesh::first_vertex, &Scene::Mesh::n_vertices)};
    if (pairs.empty() || pairs.back() != pair) pairs.push_back(pair);
  };
  for (const auto& [v, face] : given.ignored_vf()) add(v, face, true);
  for (const auto& row : given.ignored_ee()) add(row[0], row[2], false);
  for (const auto& row : given.ignored_ef()) add(row[0], row[2], true);
  for (auto& [a, b] : pairs)
    if (a > b) std::swap(a, b);
  std::ranges::sort(pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

}  // namespace hpccd
