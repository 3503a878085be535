// SPDX-License-Identifier: Apache-2.0
#include "contacts/canonical.h"

#include <algorithm>

#include "contacts/geometry.h"
#include "contacts/hash.h"

namespace hpccd {
namespace {

// What one thread adds up, on a cache line of its own.
struct alignas(64) Summary {
  std::uint64_t hash = 0;
  double first_toc = std::numeric_limits<double>::infinity();
};

void keep_earliest(std::vector<Worker>& workers) {
  double first = std::numeric_limits<double>::infinity();
  for (const Worker& w : workers)
    for (const auto* list : {&w.vertex_face, &w.edge_edge})
      for (const Found& f : *list) first = std::min(first, f.toc);
  for (Worker& w : workers)
    for (auto* list : {&w.vertex_face, &w.edge_edge})
      std::erase_if(*list, [&](const Found& f) { return f.toc > first + simultaneous; });
}

// Writes contact i of n vertex-face contacts and then edge-edge ones.
void write(Contacts& c, std::size_t n, std::size_t i, const Found& f, const Geometry& geometry, Outputs outputs,
           Summary& sum) {
  const Kind kind = i < n ? Kind::vertex_face : Kind::edge_edge;
  sum.first_toc = std::min(sum.first_toc, f.toc);
  if (kind == Kind::vertex_face) {
    c.vf[i] = {f.first, f.second};
    c.vf_toc[i] = f.toc;
    sum.hash += hash_of(kind, f.first, f.second, f.toc);
  } else {
    const auto &a = geometry.edges[f.first], &b = geometry.edges[f.second];
    c.ee[i - n] = {a[0], a[1], b[0], b[1]};
    c.ee_toc[i - n] = f.toc;
    sum.hash += hash_of(kind, pack(a[0], a[1]), pack(b[0], b[1]), f.toc);
  }
  if (!outputs.points && !outputs.normals) return;
  const ContactPoint p = contact_point(geometry, kind, f.first, f.second, f.toc, outputs.touching);
  if (outputs.points) c.points[i] = {p.point[0], p.point[1], p.point[2]};
  if (outputs.normals) c.normals[i] = {p.normal[0], p.normal[1], p.normal[2]};
}

}  // namespace

Contacts collect_contacts(std::vector<Worker>& workers, const Geometry& geometry, Report report, Outputs outputs,
                          ContactOrder& order, ThreadPool& pool) {
  if (report == Report::first) keep_earliest(workers);
  std::size_t n = 0, m = 0;
  for (const Worker& w : workers) n += w.vertex_face.size(), m += w.edge_edge.size();

  Contacts c;
  // New memory comes page by page from the system, which takes as long as the sorting: each array on its own thread.
  order.take(workers, pool, 6, [&](std::size_t array) {
    switch (array) {
      case 0:
        return c.ee.resize(m);
      case 1:
        return c.ee_toc.resize(m);
      case 2:
        return c.vf.resize(n);
      case 3:
        return c.vf_toc.resize(n);
      case 4:
        return c.points.resize(outputs.points ? n + m : 0);
      default:
        return c.normals.resize(outputs.normals ? n + m : 0);
    }
  });
  std::vector<Summary> summary(static_cast<std::size_t>(pool.size()));
  parallel_for(pool, order.buckets(), 4, [&](std::size_t begin, std::size_t end, int thread) {
    for (std::size_t bucket = begin; bucket < end; ++bucket) {
      order.sort(bucket);
      for (std::size_t i = order.begin(bucket); i < order.end(bucket); ++i)
        write(c, n, i, order[i], geometry, outputs, summary[thread]);
    }
  });
  for (const Summary& s : summary) {
    c.hash += s.hash;
    c.first_toc = std::min(c.first_toc, s.first_toc);
  }
  return c;
}

}  // namespace hpccd
