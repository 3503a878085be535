// SPDX-License-Identifier: Apache-2.0
#include "contacts/intersections.h"

#include <algorithm>

#include "contacts/hash.h"
#include "contacts/intersection_place.h"
#include "contacts/meeting_point.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

// The unit normal of a face. Sides are scaled first: products of lengths near the ends of the number range overflow.
V normal_of(const V& v0, const V& v1, const V& v2) {
  const V a = v1 - v0, b = v2 - v0;
  const double size_a = largest(a), size_b = largest(b);
  if (!(size_a > 0 && size_b > 0)) return {0, 0, 0};
  const auto scaled = [](const V& v, double size) { return V{v.x / size, v.y / size, v.z / size}; };
  return unit(cross(scaled(a, size_a), scaled(b, size_b)));
}

// The positions of one world.
class PositionsOfWorld {
 public:
  PositionsOfWorld(Positions all, std::size_t first) : all_(all), first_(first) {}
  V operator[](std::uint32_t vertex) const {
    return all_.is_double ? at(static_cast<const double*>(all_.data), vertex)
                          : at(static_cast<const float*>(all_.data), vertex);
  }

 private:
  template <class T>
  V at(const T* data, std::uint32_t vertex) const {
    const T* v = data + 3 * (first_ + vertex);
    return {v[0], v[1], v[2]};
  }

  Positions all_;
  std::size_t first_;
};

// Volino and Magnenat-Thalmann 2006, equation for an edge and a polygon: the sum over the edge's faces of R - 2 (E . R)
// / (E . N) N. E: the edge's direction, N: the normal of the intersected face, R: the direction of the curve in the
// edge's face, away from the edge.
template <class At>
V direction(const At& at, const std::array<std::uint32_t, 3>& row, const Features& features,
            const FaceAdjacency& adjacency) {
  const auto& face = features.faces[row[2]];
  const V start = at[row[0]], e = unit(at[row[1]] - start), n = normal_of(at[face[0]], at[face[1]], at[face[2]]);
  const double e_n = dot(e, n);
  V sum{0, 0, 0};
  if (e_n == 0) return sum;
  adjacency.for_each_face(row[0], row[1], [&](std::uint32_t i) {
    const auto& f = features.faces[i];
    const std::uint32_t opposite = f[0] != row[0] && f[0] != row[1]   ? f[0]
                                   : f[1] != row[0] && f[1] != row[1] ? f[1]
                                                                      : f[2];
    const V into = at[opposite] - start;
    V r = unit(cross(n, normal_of(at[f[0]], at[f[1]], at[f[2]])));
    // In the plane of both faces' edge and corner: r leaves the edge to the side of the corner.
    const double size = largest(into);
    if (!(size > 0)) return;
    const V inwards = V{into.x / size, into.y / size, into.z / size};
    const V across = inwards - dot(inwards, e) * e;
    if (dot(r, across) < 0) r = -1.0 * r;
    sum = sum + (r - (2 * dot(e, r) / e_n) * n);
  });
  return sum;
}

}  // namespace

Intersections collect_intersections(std::vector<Worker>& workers, const Geometry& geometry, ContactOrder& order,
                                    ThreadPool& pool) {
  std::size_t n = 0;
  for (const Worker& w : workers) n += w.edge_face.size();
  Intersections found;
  order.distribute(workers, pool, 1, [&](std::size_t) { resize(found.ef, n, pool.cancellation()); });
  std::vector<ThreadPool::Counter> hashes(static_cast<std::size_t>(pool.size()));
  parallel_for(pool, order.buckets(), 4, [&](std::size_t begin, std::size_t end, int thread) {
    std::uint64_t hash = 0;
    for (std::size_t bucket = begin; bucket < end; ++bucket) {
      order.sort(bucket, pool.cancellation());
      for (std::size_t i = order.begin(bucket); i < order.end(bucket); ++i) {
        const auto& edge = geometry.edges[order[i].first];
        const std::uint32_t face = order[i].second;
        found.ef[i] = {edge[0], edge[1], face};
        hash += hash_of(Kind::edge_face, pack(edge[0], edge[1]), face, 0);
      }
    }
    hashes[static_cast<std::size_t>(thread)].value += hash;
  });
  for (const auto& h : hashes) found.hash += h.value;
  return found;
}

namespace {

// positions_of(world)[vertex]
template <class PositionsOf>
void add_places_by(Intersections& found, const Features& features, PositionsOf&& positions_of,
                   const FaceAdjacency* adjacency, ThreadPool& pool) {
  const Cancellation& cancellation = pool.cancellation();
  const std::size_t n = found.ef.size();
  resize(found.points, n, cancellation), resize(found.edge_parameters, n, cancellation);
  resize(found.weights, n, cancellation), resize(found.incidences, n, cancellation);
  if (adjacency) resize(found.directions, n, cancellation);
  const auto& first_row = found.slices.ef;
  parallel_for(pool, n, 256, [&](std::size_t begin, std::size_t end, int) {
    std::size_t world = first_row.empty() ? 0 : std::ranges::upper_bound(first_row, begin) - first_row.begin() - 1;
    for (std::size_t i = begin; i < end; ++i) {
      while (!first_row.empty() && i >= first_row[world + 1]) ++world;
      const auto at = positions_of(world);
      const auto& row = found.ef[i];
      const auto& face = features.faces[row[2]];
      const V q[5] = {at[row[0]], at[row[1]], at[face[0]], at[face[1]], at[face[2]]};
      const IntersectionPlace place = intersection_place(q);
      const V point = point_on_edge(q, place);
      found.points[i] = {point.x, point.y, point.z};
      found.edge_parameters[i] = place.edge_parameter;
      std::ranges::copy(place.weights, found.weights[i].begin());
      found.incidences[i] = place.incidence;
      if (!adjacency) continue;
      const V d = direction(at, row, features, *adjacency);
      found.directions[i] = {d.x, d.y, d.z};
    }
  });
}

}  // namespace

void add_places(Intersections& found, const Features& features, Positions vertices, const FaceAdjacency* adjacency,
                ThreadPool& pool) {
  add_places_by(
      found, features, [&](std::size_t world) { return PositionsOfWorld(vertices, world * features.n_vertices); },
      adjacency, pool);
}

void add_places(Intersections& found, const Features& features, const PositionOf& position_of,
                const FaceAdjacency* adjacency, ThreadPool& pool) {
  struct At {
    const PositionOf& position_of;
    V operator[](std::uint32_t vertex) const { return position_of(vertex); }
  };
  add_places_by(found, features, [&](std::size_t) { return At{position_of}; }, adjacency, pool);
}

}  // namespace hpccd
