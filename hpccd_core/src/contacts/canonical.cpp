// SPDX-License-Identifier: Apache-2.0
#include "contacts/canonical.h"

#include <algorithm>

#include "contacts/geometry.h"
#include "contacts/hash.h"
#include "contacts/order.h"

namespace hpccd {
namespace {

std::vector<Found> take(std::vector<Worker>& workers, std::vector<Found> Worker::*list, ThreadPool& pool) {
  std::vector<const std::vector<Found>*> lists;
  for (Worker& w : workers) lists.push_back(&(w.*list));
  return sorted(lists, pool);
}

}  // namespace

Contacts collect_contacts(std::vector<Worker>& workers, const Geometry& geometry, Report report, Outputs outputs,
                          ThreadPool& pool) {
  Contacts c;
  std::vector<Found> vf = take(workers, &Worker::vertex_face, pool), ee = take(workers, &Worker::edge_edge, pool);
  for (const auto* list : {&vf, &ee})
    for (const Found& f : *list) c.first_toc = std::min(c.first_toc, f.toc);
  if (report == Report::first) {
    const auto later = [&](const Found& f) { return f.toc > c.first_toc + simultaneous; };
    std::erase_if(vf, later);
    std::erase_if(ee, later);
  }

  const std::size_t n = vf.size(), m = ee.size();
  c.vf.resize(n), c.vf_toc.resize(n), c.ee.resize(m), c.ee_toc.resize(m);
  if (outputs.points) c.points.resize(n + m);
  if (outputs.normals) c.normals.resize(n + m);
  std::vector<std::uint64_t> hash(static_cast<std::size_t>(pool.size()), 0);
  parallel_for(pool, n + m, 2048, [&](std::size_t begin, std::size_t end, int thread) {
    for (std::size_t i = begin; i < end; ++i) {
      const Kind kind = i < n ? Kind::vertex_face : Kind::edge_edge;
      const Found& f = i < n ? vf[i] : ee[i - n];
      if (kind == Kind::vertex_face) {
        c.vf[i] = {f.first, f.second};
        c.vf_toc[i] = f.toc;
        hash[thread] += hash_of(kind, f.first, f.second, f.toc);
      } else {
        const auto &a = geometry.edges[f.first], &b = geometry.edges[f.second];
        c.ee[i - n] = {a[0], a[1], b[0], b[1]};
        c.ee_toc[i - n] = f.toc;
        hash[thread] += hash_of(kind, pack(a[0], a[1]), pack(b[0], b[1]), f.toc);
      }
      if (outputs.points || outputs.normals) {
        const ContactPoint p = contact_point(geometry, kind, f.first, f.second, f.toc);
        if (outputs.points) c.points[i] = {p.point[0], p.point[1], p.point[2]};
        if (outputs.normals) c.normals[i] = {p.normal[0], p.normal[1], p.normal[2]};
      }
    }
  });
  for (std::uint64_t h : hash) c.hash += h;
  return c;
}

}  // namespace hpccd
