// SPDX-License-Identifier: Apache-2.0
#include "backends/gpu_contacts.h"

#include <algorithm>
#include <functional>

#include "backends/world_positions.h"
#include "contacts/hash.h"
#include "elementary/batch.h"
#include "elementary/intersection_batch.h"
#include "traverse/worker.h"

namespace hpccd {
namespace {

using VertexFace = std::array<std::uint32_t, 2>;
using EdgeEdge = std::array<std::uint32_t, 4>;
using EdgeFace = std::array<std::uint32_t, 3>;

// A copy of `from` with one more element at each of the positions in `at` (ascending), by whole runs.
template <class T, class Get>
std::vector<T> spliced(const T* from, std::size_t n, const std::vector<std::size_t>& at, Get&& get) {
  std::vector<T> all;
  all.reserve(n + at.size());
  std::size_t done = 0;
  for (std::size_t k = 0; k < at.size(); ++k) {
    all.insert(all.end(), from + done, from + at[k]);
    done = at[k];
    all.push_back(get(k));
  }
  all.insert(all.end(), from + done, from + n);
  return all;
}

// The position of each row among n others.
template <class Row, class Get>
std::vector<std::size_t> places(const Row* among, std::size_t n, std::size_t n_rows, Get&& row) {
  std::vector<std::size_t> at(n_rows);
  for (std::size_t i = 0; i < n_rows; ++i)
    at[i] = static_cast<std::size_t>(std::lower_bound(among, among + n, row(i)) - among);
  return at;
}

Vec3<double> position(Positions p, std::uint32_t vertex) {
  const std::size_t i = 3 * std::size_t{vertex};
  if (p.is_double) {
    const auto* x = static_cast<const double*>(p.data) + i;
    return {x[0], x[1], x[2]};
  }
  const auto* x = static_cast<const float*>(p.data) + i;
  return {x[0], x[1], x[2]};
}

std::uint64_t hash_of_row(const VertexFace& row, double toc) { return hash_of(Kind::vertex_face, row[0], row[1], toc); }
std::uint64_t hash_of_row(const EdgeEdge& row, double toc) {
  return hash_of(Kind::edge_edge, pack(row[0], row[1]), pack(row[2], row[3]), toc);
}

double earliest(const std::vector<double>& toc) {
  double t = std::numeric_limits<double>::infinity();
  for (const double x : toc) t = x < t ? x : t;
  return t;
}

template <class Row>
void keep_until(std::vector<Row>& rows, std::vector<double>& toc, double last, std::size_t most) {
  std::size_t n = 0;
  for (std::size_t i = 0; i < rows.size() && n < most; ++i)
    if (toc[i] <= last) rows[n] = rows[i], toc[n++] = toc[i];
  rows.resize(n);
  toc.resize(n);
}

Geometry topology(const Features& features) { return {nullptr, features.edges.data(), features.faces.data()}; }

template <class X>
std::vector<X> copied(const X* from, std::size_t n) {
  return {from, from + n};
}

}  // namespace

Contacts join(const gpu::FrameResult& d, const DecidedContacts& decided, const Features& features, ThreadPool& pool) {
  const auto &vf = decided.vertex_face, &ee = decided.edge_edge;
  const auto vf_row = [&](std::size_t i) { return VertexFace{vf[i].first, vf[i].second}; };
  const auto ee_row = [&](std::size_t i) {
    const auto &a = features.edges[ee[i].first], &b = features.edges[ee[i].second];
    return EdgeEdge{a[0], a[1], b[0], b[1]};
  };
  const auto at_vf = places(d.vf, d.n_vf, vf.size(), vf_row), at_ee = places(d.ee, d.n_ee, ee.size(), ee_row);
  Contacts c;
  double first_vf = c.first_toc, first_ee = c.first_toc;
  const std::function<void()> parts[4] = {
      [&] { c.ee = spliced(d.ee, d.n_ee, at_ee, ee_row); },
      [&] {
        c.ee_toc = spliced(d.toc + d.n_vf, d.n_ee, at_ee, [&](std::size_t i) { return ee[i].toc; });
        first_ee = earliest(c.ee_toc);
      },
      [&] { c.vf = spliced(d.vf, d.n_vf, at_vf, vf_row); },
      [&] {
        c.vf_toc = spliced(d.toc, d.n_vf, at_vf, [&](std::size_t i) { return vf[i].toc; });
        first_vf = earliest(c.vf_toc);
      }};
  const auto copy = [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) parts[i]();
  };
  // Waking the threads costs about as much as copying 10,000 contacts.
  if (d.n_vf + d.n_ee > 10000)
    parallel_for(pool, 4, 1, copy);
  else
    copy(0, 4, 0);
  c.first_toc = std::min(first_vf, first_ee);
  c.hash = d.hash;
  for (std::size_t i = 0; i < vf.size(); ++i) c.hash += hash_of_row(vf_row(i), vf[i].toc);
  for (std::size_t i = 0; i < ee.size(); ++i) c.hash += hash_of_row(ee_row(i), ee[i].toc);
  return c;
}

void reduce(Contacts& c, Report report) {
  if (report == Report::all) return;
  if (report == Report::any) {
    constexpr double any_time = std::numeric_limits<double>::infinity();
    keep_until(c.vf, c.vf_toc, any_time, 1);
    keep_until(c.ee, c.ee_toc, any_time, 1 - c.vf.size());
    c.first_toc = std::min(earliest(c.vf_toc), earliest(c.ee_toc));
  } else {
    keep_until(c.vf, c.vf_toc, c.first_toc, c.vf.size());
    keep_until(c.ee, c.ee_toc, c.first_toc, c.ee.size());
  }
  c.hash = 0;
  for (std::size_t i = 0; i < c.vf.size(); ++i) c.hash += hash_of_row(c.vf[i], c.vf_toc[i]);
  for (std::size_t i = 0; i < c.ee.size(); ++i) c.hash += hash_of_row(c.ee[i], c.ee_toc[i]);
}

Intersections join_intersections(const gpu::FrameResult& d, const DecidedContacts& decided, const Features& features) {
  const auto row = [&](std::size_t i) {
    const Contact& c = decided.vertex_face[i];
    return EdgeFace{features.edges[c.first][0], features.edges[c.first][1], c.second};
  };
  Intersections found;
  found.ef = spliced(d.ef, d.n_ef, places(d.ef, d.n_ef, decided.vertex_face.size(), row), row);
  found.hash = d.hash;
  for (std::size_t i = 0; i < decided.vertex_face.size(); ++i) {
    const EdgeFace r = row(i);
    found.hash += hash_of(Kind::edge_face, pack(r[0], r[1]), r[2], 0);
  }
  return found;
}

void add_places(Contacts& c, Outputs outputs, const Features& features, const Separations& separations, Positions t0,
                Positions t1, ThreadPool& pool) {
  const auto& edges = features.edges;
  std::vector<VertexMotion> vertices(t0.n);
  parallel_for(pool, vertices.size(), 4096, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3<double> a = position(t0, static_cast<std::uint32_t>(i)),
                         b = position(t1, static_cast<std::uint32_t>(i));
      vertices[i] = {{a.x, a.y, a.z, 0}, {b.x, b.y, b.z, 0}};
    }
  });
  Geometry geometry{vertices.data(), edges.data(), features.faces.data()};
  geometry.separations = separations;
  const auto edge_number = [&](std::uint32_t v0, std::uint32_t v1) {
    const std::array<std::uint32_t, 2> e{v0, v1};
    return static_cast<std::uint32_t>(std::lower_bound(edges.begin(), edges.end(), e) - edges.begin());
  };
  const std::size_t n = c.vf.size(), m = c.ee.size();
  for_each_output(outputs, [&](auto list) { (c.*list).resize(n + m); });
  parallel_for(pool, n + m, 1024, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) {
      const bool vf = i < n;
      const std::uint32_t first = vf ? c.vf[i][0] : edge_number(c.ee[i - n][0], c.ee[i - n][1]);
      const std::uint32_t second = vf ? c.vf[i][1] : edge_number(c.ee[i - n][2], c.ee[i - n][3]);
      write_places(c, i, {first, second, vf ? Kind::vertex_face : Kind::edge_edge}, vf ? c.vf_toc[i] : c.ee_toc[i - n],
                   geometry, outputs);
    }
  });
}

UndecidedPair undecided_pair(const Features& features, const Separations& separations, const Candidate& pair,
                             Positions t0, Positions t1) {
  std::uint32_t v[4];
  pair_vertices(topology(features), pair.kind, pair.first, pair.second, v);
  UndecidedPair q{pair.kind, {}, {}, separations.look_up(pair.kind, pair.first, pair.second, v)};
  for (int k = 0; k < 4; ++k) q.t0[k] = position(t0, v[k]), q.t1[k] = position(t1, v[k]);
  return q;
}

void edge_face_positions(const Features& features, const Candidate& pair, Positions vertices, Vec3<double> q[5]) {
  std::uint32_t v[5];
  edge_face_vertices(topology(features), pair.first, pair.second, v);
  for (int k = 0; k < 5; ++k) q[k] = position(vertices, v[k]);
}

DecidedContacts decided_contacts(const std::vector<Candidate>& pairs,
                                 const std::vector<std::optional<double>>& values) {
  DecidedContacts decided;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!values[i]) continue;
    auto& list = pairs[i].kind == Kind::vertex_face ? decided.vertex_face : decided.edge_edge;
    list.push_back({pairs[i].first, pairs[i].second, *values[i]});
  }
  for (auto* list : {&decided.vertex_face, &decided.edge_edge}) std::sort(list->begin(), list->end(), before);
  return decided;
}

Contacts contacts_of(const gpu::FrameResult& f, std::size_t n_worlds, ThreadPool& pool) {
  Contacts c;
  const std::function<void()> parts[] = {
      [&] { c.ee = copied(f.ee, f.n_ee); }, [&] { c.ee_toc = copied(f.toc + f.n_vf, f.n_ee); },
      [&] { c.vf = copied(f.vf, f.n_vf); }, [&] { c.vf_toc = copied(f.toc, f.n_vf); }};
  parallel_for(pool, std::size(parts), 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) parts[i]();
  });
  c.slices.vf = copied(f.vf_offsets, n_worlds + 1), c.slices.ee = copied(f.ee_offsets, n_worlds + 1);
  c.slices.hashes = copied(f.hashes, n_worlds);
  c.hash = f.hash;
  c.first_tocs = copied(f.first_tocs, n_worlds);
  c.first_toc = f.first_toc;
  return c;
}

Intersections intersections_of(const gpu::FrameResult& f, std::size_t n_worlds) {
  Intersections found;
  found.ef = copied(f.ef, f.n_ef);
  found.slices.ef = copied(f.ef_offsets, n_worlds + 1);
  found.slices.hashes = copied(f.hashes, n_worlds);
  found.hash = f.hash;
  return found;
}

void add_places_of_worlds(Contacts& all, Outputs outputs, const Features& features, const Separations& separations,
                          Positions t0, Positions t1, ThreadPool& pool) {
  const std::size_t n = all.vf.size();
  for_each_output(outputs, [&](auto list) { (all.*list).resize(n + all.ee.size()); });
  for (std::size_t k = 0; k + 1 < all.slices.vf.size(); ++k) {
    const std::size_t vf = all.slices.vf[k], ee = all.slices.ee[k];
    const std::size_t n_vf = all.slices.vf[k + 1] - vf, n_ee = all.slices.ee[k + 1] - ee;
    Contacts one;
    one.vf = copied(all.vf.data() + vf, n_vf), one.vf_toc = copied(all.vf_toc.data() + vf, n_vf);
    one.ee = copied(all.ee.data() + ee, n_ee), one.ee_toc = copied(all.ee_toc.data() + ee, n_ee);
    add_places(one, outputs, features, separations, of_world(t0, features.n_vertices, k),
               of_world(t1, features.n_vertices, k), pool);
    for_each_output(outputs, [&](auto list) {
      std::copy_n((one.*list).begin(), n_vf, (all.*list).begin() + static_cast<std::ptrdiff_t>(vf));
      std::copy_n((one.*list).begin() + static_cast<std::ptrdiff_t>(n_vf), n_ee,
                  (all.*list).begin() + static_cast<std::ptrdiff_t>(n + ee));
    });
  }
}

}  // namespace hpccd
