// SPDX-License-Identifier: Apache-2.0
#include "backends/gpu_contacts.h"

#include <algorithm>
#include <functional>

#include "backends/gpu_undecided.h"
#include "contacts/hash.h"
#include "traverse/worker.h"

namespace hpccd {
namespace {

using VertexFace = std::array<std::uint32_t, 2>;
using EdgeEdge = std::array<std::uint32_t, 4>;
using EdgeFace = std::array<std::uint32_t, 3>;

// `from` with one more at each of the places in `at` (ascending), by whole runs.
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

// Where each of the rows goes among n others.
template <class Row, class Get>
std::vector<std::size_t> places(const Row* among, std::size_t n, std::size_t n_rows, Get&& row) {
  std::vector<std::size_t> at(n_rows);
  for (std::size_t i = 0; i < n_rows; ++i)
    at[i] = static_cast<std::size_t>(std::lower_bound(among, among + n, row(i)) - among);
  return at;
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
  if (outputs.points) c.points.resize(n + m);
  if (outputs.normals) c.normals.resize(n + m);
  if (outputs.closest) c.closest.resize(n + m);
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

}  // namespace hpccd
