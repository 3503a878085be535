// SPDX-License-Identifier: Apache-2.0
#include "backends/planes.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "contacts/hash.h"
#include "contacts/places.h"
#include "contacts/worlds.h"
#include "scene/plane.h"

namespace hpccd {
namespace {

using V = Vec3<double>;
constexpr double never = std::numeric_limits<double>::infinity();

template <class Real>
V position(const Real* x, std::size_t vertex) {
  return {x[3 * vertex], x[3 * vertex + 1], x[3 * vertex + 2]};
}

template <class F>
auto with_type(Positions p, F&& f) {
  return p.is_double ? f(double{}) : f(float{});
}

template <class Real>
const Real* numbers(Positions p) {
  return static_cast<const Real*>(p.data);
}

// Vertices that are marked together: in a core's nearest cache.
constexpr std::size_t block = 256;

// Marks vertices that are not certainly apart; returns whether there are any.
template <class Real, class Apart>
bool mark(const Real* x, std::size_t n, unsigned char* open, Apart&& apart) {
  unsigned char any = 0;
  for (std::size_t i = 0; i < n; ++i) any |= open[i] |= !apart(x + 3 * i);
  return any;
}

// By coordinates: compilers make vector instructions of the second loop, and twice as fast code of both as of one.
template <class Real>
bool mark_slanted(const HalfSpace& h, const Real* v, std::size_t n, unsigned char* open) {
  double x[block], y[block], z[block];
  for (std::size_t i = 0; i < n; ++i) x[i] = v[3 * i], y[i] = v[3 * i + 1], z[i] = v[3 * i + 2];
  unsigned char any = 0;
  for (std::size_t i = 0; i < n; ++i) any |= open[i] |= !h.apart(x[i], y[i], z[i]);
  return any;
}

template <class Real>
bool mark(const HalfSpace& h, const Real* x, std::size_t n, unsigned char* open) {
  // The coordinate is known when compiled: with it as a variable the loop has no vector instructions.
  switch (h.axis()) {
    case 0:
      return mark(x, n, open, [&](const Real* v) { return h.apart_along_axis(v[0]); });
    case 1:
      return mark(x, n, open, [&](const Real* v) { return h.apart_along_axis(v[1]); });
    case 2:
      return mark(x, n, open, [&](const Real* v) { return h.apart_along_axis(v[2]); });
    default:
      return mark_slanted(h, x, n, open);
  }
}

constexpr double time_error = 1e-12;  // of HalfSpace::time

V at_time(const V& x0, const V& x1, double t) { return t <= 0 ? x0 : t >= 1 ? x1 : x0 + t * (x1 - x0); }

std::array<double, 3> row(const V& v) { return {v.x, v.y, v.z}; }

}  // namespace

Planes::Planes(const Scene& scene, Accuracy accuracy, const SeparationTable& separations,
               const ThicknessTable& thickness, const FeatureFilter& filter)
    : scene_(scene), separations_(separations), thickness_(thickness), filter_(filter) {
  const auto& meshes = scene.meshes();
  for (std::uint32_t m = 0; m < meshes.size(); ++m) {
    if (!meshes[m].plane) continue;
    OfScene of{m, *meshes[m].plane, std::vector<char>(meshes.size()), std::vector<char>(meshes.size())};
    for (std::uint32_t other = 0; other < meshes.size(); ++other) {
      of.tested[other] = scene.pair_enabled(m, other);
      of.early[other] = scene.pair_accuracy(m, other, accuracy) == Accuracy::conservative;
    }
    planes_.push_back(std::move(of));
  }
}

void Planes::set(std::uint32_t mesh, const Plane& value) {
  const auto plane = std::ranges::find(planes_, mesh, &OfScene::mesh);
  if (plane == planes_.end())
    throw InvalidArgument("plane: number " + std::to_string(mesh) +
                          " is no plane of the scene; give the number that Scene::add_plane() returned");
  check_plane(value);
  plane->plane = value;
}

// The mesh of a vertex of one world: the last one that begins at or before it, as others there are empty.
std::uint32_t Planes::mesh_of(std::size_t vertex) const {
  const auto& meshes = scene_.meshes();
  const auto next = std::ranges::upper_bound(meshes, vertex, {}, &Scene::Mesh::first_vertex);
  return static_cast<std::uint32_t>(next - meshes.begin()) - 1;
}

// f(begin, end, mesh, plane, half-space) for parts of meshes among vertices [begin, end), counted through all worlds.
// The half-space is that of the thickest vertex of the mesh.
template <class F>
void Planes::for_parts(std::size_t begin, std::size_t end, const Query& query, F&& f) const {
  const auto& meshes = scene_.meshes();
  const std::size_t n = scene_.n_vertices();
  std::vector<std::optional<HalfSpace>> made(planes_.size());  // for the last separation
  for (std::size_t at = begin; at < end;) {
    const std::size_t first = at - at % n;  // of this world
    const std::uint32_t mesh = mesh_of(at - first);
    const std::size_t last = std::min(end, first + meshes[mesh].first_vertex + meshes[mesh].n_vertices);
    for (std::uint32_t p = 0; p < planes_.size(); ++p) {
      if (!planes_[p].tested[mesh]) continue;
      const double d = reach(p, mesh, thickness_.any() ? thickness_.largest_of_meshes()[mesh] : 0, query);
      if (!made[p] || made[p]->separation() != d) made[p].emplace(planes_[p].plane, d);
      f(at, last, mesh, p, *made[p]);
    }
    at = last;
  }
}

template <class Real>
void Planes::find(const Query& query, std::size_t begin, std::size_t end, std::vector<Hit>& hits) const {
  const Real *x0 = numbers<Real>(query.t0), *x1 = numbers<Real>(query.t1);
  const auto test = [&](std::size_t i, std::uint32_t mesh, std::uint32_t plane, const HalfSpace& h, double thickness) {
    const V v = position(x0, i);
    if (!query.distance) {
      if (const auto time = h.time(v, position(x1, i)))
        hits.push_back({i, plane, planes_[plane].early[mesh] ? std::max(0.0, *time - time_error) : *time});
    } else if (h.within(v)) {
      hits.push_back({i, plane, h.distance(v) - thickness});
    }
  };
  const auto test_block = [&](std::size_t from, std::size_t n, std::uint32_t mesh, std::uint32_t plane,
                              const HalfSpace& h) {
    unsigned char open[block] = {};
    bool any = mark(h, x0 + 3 * from, n, open);
    if (x0 != x1) any |= mark(h, x1 + 3 * from, n, open);
    for (std::size_t i = from; any && i < from + n; ++i) {
      if (!open[i - from]) continue;
      const auto v = static_cast<std::uint32_t>(i % scene_.n_vertices());
      if (filter_.ignores(v, planes_[plane].mesh)) continue;
      const double thickness = thickness_of_vertex(v);
      if (thickness_.even(mesh))
        test(i, mesh, plane, h, thickness);
      else
        test(i, mesh, plane, {planes_[plane].plane, reach(plane, mesh, thickness, query)}, thickness);
    }
  };
  for_parts(begin, end, query,
            [&](std::size_t first, std::size_t last, std::uint32_t mesh, std::uint32_t plane, const HalfSpace& h) {
              for (std::size_t from = first; from < last; from += block)
                test_block(from, std::min(block, last - from), mesh, plane, h);
            });
  if (planes_.size() > 1) std::ranges::sort(hits, {}, [](const Hit& h) { return std::pair(h.vertex, h.plane); });
}

Planes::Hits Planes::find(const Query& query, ThreadPool& pool) const {
  constexpr std::size_t grain = 2048;  // with 8192, one of two threads had most of a cloth of 10,000 vertices
  const std::size_t n = query.t0.n;
  Hits hits((n + grain - 1) / grain);
  parallel_for(pool, n, grain, [&](std::size_t begin, std::size_t end, int) {
    with_type(query.t0, [&]<class Real>(Real) {
      for (std::size_t from = begin; from < end; from += grain)
        find<Real>(query, from, std::min(end, from + grain), hits[from / grain]);
    });
  });
  return hits;
}

template <class Real>
void Planes::write_places(Contacts& c, std::size_t i, const Hit& hit, const Query& query, Outputs outputs) const {
  const V x0 = position(numbers<Real>(query.t0), hit.vertex), x1 = position(numbers<Real>(query.t1), hit.vertex);
  const auto vertex = static_cast<std::uint32_t>(hit.vertex % scene_.n_vertices());
  const double separated = reach(hit.plane, mesh_of(vertex), thickness_of_vertex(vertex), query);
  const HalfSpace h(planes_[hit.plane].plane, separated);
  const V x = query.distance ? x0 : at_time(x0, x1, hit.value), foot = x - h.distance(x) * h.unit_normal();
  if (outputs.points) c.points[i] = row(separated > 0 ? 0.5 * (x + foot) : x);
  if (outputs.normals) c.normals[i] = row(h.unit_normal());
  if (outputs.closest) c.closest[i] = {row(x), row(foot)};
  if (!outputs.weights) return;
  c.vertices[i] = {vertex, vertex, vertex, vertex};
  c.weights[i] = {1, 0, 0, 0};
  if (outputs.at == AtTime::contact) c.approach[i] = h.change(x0, x1);
}

std::size_t Planes::append(Contacts& c, const Hits& hits, const Query& query, Outputs outputs, ThreadPool& pool) const {
  std::vector<std::size_t> begin(hits.size() + 1);
  for (std::size_t k = 0; k < hits.size(); ++k) begin[k + 1] = begin[k] + hits[k].size();
  const std::size_t n = begin.back(), before = c.vf.size() + c.ee.size(), n_vertices = scene_.n_vertices();
  resize(c.vp, n, pool.cancellation()), resize(c.vp_toc, n, pool.cancellation());
  for_each_output(outputs, [&](auto list) { resize(c.*list, before + n, pool.cancellation()); });
  const std::size_t worlds = c.slices.hashes.size();
  if (worlds) c.slices.vp.assign(worlds + 1, 0);
  for (std::size_t k = 0; k < hits.size(); ++k)
    for (std::size_t i = 0; i < hits[k].size(); ++i) {
      const Hit& hit = hits[k][i];
      const auto vertex = static_cast<std::uint32_t>(hit.vertex % n_vertices);
      c.vp[begin[k] + i] = {vertex, hit.plane};
      c.vp_toc[begin[k] + i] = hit.value;
      const std::uint64_t hash = hash_of_vertex_plane(vertex, hit.plane, hit.value);
      const std::size_t world = hit.vertex / n_vertices;
      c.hash += hash_weight(world) * hash;
      if (!query.distance) c.first_toc = std::min(c.first_toc, hit.value);
      if (!worlds) continue;
      ++c.slices.vp[world + 1];
      c.slices.hashes[world] += hash;
      if (!query.distance) c.first_tocs[world] = std::min(c.first_tocs[world], hit.value);
    }
  std::partial_sum(c.slices.vp.begin(), c.slices.vp.end(), c.slices.vp.begin());
  if (outputs.any())
    parallel_for(pool, hits.size(), 1, [&](std::size_t from, std::size_t to, int) {
      for (std::size_t k = from; k < to; ++k)
        for (std::size_t i = 0; i < hits[k].size(); ++i)
          with_type(query.t0, [&]<class Real>(Real) {
            write_places<Real>(c, before + begin[k] + i, hits[k][i], query, outputs);
          });
    });
  return n;
}

std::size_t Planes::add_contacts(Contacts& c, Positions t0, Positions t1, Report report, Outputs outputs,
                                 ThreadPool& pool) const {
  const Query query{t0, t1, {}};
  Hits hits = find(query, pool);
  if (report != Report::all) {
    const std::size_t n = scene_.n_vertices(), worlds = std::max<std::size_t>(1, c.slices.hashes.size());
    std::vector<double> first = worlds > 1 ? c.first_tocs : std::vector{c.first_toc};
    std::vector<char> drop(worlds, false);  // the other contacts, which are later
    if (report == Report::first)
      for (const auto& piece : hits)
        for (const Hit& hit : piece)
          if (double& time = first[hit.vertex / n]; hit.value < time) time = hit.value, drop[hit.vertex / n] = true;
    for (auto& piece : hits)
      std::erase_if(piece, [&](const Hit& hit) {
        double& time = first[hit.vertex / n];
        if (report == Report::first) return hit.value > time;
        if (time < never) return true;
        time = hit.value;  // no other one of this world
        return false;
      });
    if (std::ranges::count(drop, true)) drop_worlds(c, drop);
  }
  return append(c, hits, query, outputs, pool);
}

std::size_t Planes::add_near(Contacts& near, Positions vertices, double distance, Outputs outputs,
                             ThreadPool& pool) const {
  const Query query{vertices, vertices, distance};
  return append(near, find(query, pool), query, outputs, pool);
}

void Planes::limit_steps(std::vector<double>& first, Positions t0, Positions t1, ThreadPool& pool) const {
  for (const auto& piece : find({t0, t1, {}}, pool))
    for (const Hit& hit : piece) {
      double& time = first[hit.vertex / scene_.n_vertices()];
      time = std::min(time, std::max(0.0, hit.value - time_error));
    }
}

void Planes::add_touching(std::vector<Shortening::Touching>& pairs, Positions t0, Positions t1,
                          ThreadPool& pool) const {
  for (const auto& piece : find({t0, t1, {}}, pool))
    for (const Hit& hit : piece) {
      const auto v = static_cast<std::uint32_t>(hit.vertex);
      pairs.push_back({{v, v, v, v}, hit.value});
    }
}

template <class Real>
Gap Planes::gap(std::uint32_t plane, std::uint32_t mesh, const Real* vertices) const {
  const Scene::Mesh& m = scene_.meshes()[mesh];
  const HalfSpace h(planes_[plane].plane, 0);
  const double thickest = thickness_.any() ? thickness_.largest_of_meshes()[mesh] : 0;
  Gap gap{std::min(mesh, planes_[plane].mesh), std::max(mesh, planes_[plane].mesh)};
  for (std::uint32_t v = m.first_vertex; v < m.first_vertex + m.n_vertices; ++v) {
    const Real* x = vertices + 3 * std::size_t{v};
    if (!(h.least_distance(x[0], x[1], x[2]) - thickest <= gap.distance)) continue;
    if (filter_.ignores(v, planes_[plane].mesh)) continue;
    const double distance = h.distance({x[0], x[1], x[2]}) - thickness_of_vertex(v);
    if (distance < gap.distance) gap.distance = distance, gap.features = {v, plane}, gap.kind = GapKind::vertex_plane;
  }
  if (gap.kind == GapKind::none) return gap;
  const std::uint32_t v = gap.features[0];
  const V x = position(vertices, v);
  gap.points = {row(x), row(x - h.distance(x) * h.unit_normal())};
  gap.vertices = {v, v, v, v};
  gap.weights = {1, 0, 0, 0};
  gap.normal = row(h.unit_normal());
  return gap;
}

void Planes::add_gaps(std::vector<Gap>& gaps, Positions vertices, std::size_t worlds, ThreadPool& pool) const {
  std::vector<std::array<std::uint32_t, 2>> pairs;  // plane, mesh
  for (std::uint32_t p = 0; p < planes_.size(); ++p)
    for (std::uint32_t m = 0; m < scene_.meshes().size(); ++m)
      if (planes_[p].tested[m]) pairs.push_back({p, m});
  const std::size_t n = pairs.size(), n_others = gaps.size() / worlds;
  std::vector<Gap> of_planes(n * worlds);
  parallel_for_each(pool, of_planes.size(), [&](std::size_t i) {
    with_type(vertices, [&]<class Real>(Real) {
      const Real* of_world = numbers<Real>(vertices) + i / n * 3 * scene_.n_vertices();
      of_planes[i] = gap(pairs[i % n][0], pairs[i % n][1], of_world);
    });
  });
  const auto key = [](const Gap& g) { return std::pair(g.mesh_a, g.mesh_b); };
  std::vector<Gap> all;
  all.reserve(gaps.size() + of_planes.size());
  for (std::size_t k = 0; k < worlds; ++k) {
    const auto planes = of_planes.begin() + static_cast<std::ptrdiff_t>(k * n);
    const auto others = gaps.begin() + static_cast<std::ptrdiff_t>(k * n_others);
    std::sort(planes, planes + static_cast<std::ptrdiff_t>(n),
              [&](const Gap& a, const Gap& b) { return key(a) < key(b); });
    std::merge(others, others + static_cast<std::ptrdiff_t>(n_others), planes, planes + static_cast<std::ptrdiff_t>(n),
               std::back_inserter(all), [&](const Gap& a, const Gap& b) { return key(a) < key(b); });
  }
  gaps = std::move(all);
}

}  // namespace hpccd
