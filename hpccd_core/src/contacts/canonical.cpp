// SPDX-License-Identifier: Apache-2.0
#include "contacts/canonical.h"

#include <algorithm>

#include "contacts/hash.h"
#include "contacts/places.h"

namespace hpccd {
namespace {

// Partial sums of one thread, on a cache line of its own.
struct alignas(64) Summary {
  std::uint64_t hash = 0;
  double first_toc = std::numeric_limits<double>::infinity();
};

// Contacts per piece of work: 1 ms if points and normals are requested.
constexpr std::size_t some = 4096;

void keep_earliest(std::vector<Worker>& workers, const Cancellation& cancellation) {
  double first = std::numeric_limits<double>::infinity();
  for (const Worker& w : workers)
    for (const auto* list : {&w.vertex_face, &w.edge_edge})
      in_pieces(cancellation, list->size(), some, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) first = std::min(first, (*list)[i].toc);
      });
  for (Worker& w : workers)
    for (auto* list : {&w.vertex_face, &w.edge_edge}) {
      cancellation.heed();
      std::erase_if(*list, [&](const Contact& f) { return f.toc > first; });
    }
}

// Writes contact i into the result of n vertex-face contacts followed by edge-edge contacts.
void write(Contacts& c, std::size_t n, std::size_t i, const Contact& f, const Geometry& geometry, Outputs outputs,
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
  write_places(c, i, {f.first, f.second, kind}, f.toc, geometry, outputs);
}

}  // namespace

void collect_contacts(std::vector<Worker>& workers, const Geometry& geometry, Report report, Outputs outputs,
                      ContactOrder& order, ThreadPool& pool, Contacts& c) {
  const Cancellation& cancellation = pool.cancellation();
  if (report == Report::first) keep_earliest(workers, cancellation);
  std::size_t n = 0, m = 0;
  for (const Worker& w : workers) n += w.vertex_face.size(), m += w.edge_edge.size();

  // New memory is mapped page by page, which takes as long as the sorting: each array is filled by its own thread.
  std::size_t n_outputs = 0;
  for_each_output(outputs, [&](auto) { ++n_outputs; });
  order.distribute(workers, pool, 4 + n_outputs, [&](std::size_t array) {
    switch (array) {
      case 0:
        return resize(c.ee, m, cancellation);
      case 1:
        return resize(c.ee_toc, m, cancellation);
      case 2:
        return resize(c.vf, n, cancellation);
      case 3:
        return resize(c.vf_toc, n, cancellation);
      default:
        std::size_t output = 4;
        for_each_output(outputs, [&](auto list) {
          if (output++ == array) resize(c.*list, n + m, cancellation);
        });
    }
  });
  std::vector<Summary> summary(static_cast<std::size_t>(pool.size()));
  parallel_for(pool, order.buckets(), 64, [&](std::size_t begin, std::size_t end, int thread) {
    for (std::size_t bucket = begin; bucket < end; ++bucket) {
      order.sort(bucket, cancellation);
      const std::size_t first = order.begin(bucket);
      in_pieces(cancellation, order.end(bucket) - first, some, [&](std::size_t from, std::size_t to) {
        for (std::size_t i = first + from; i < first + to; ++i)
          write(c, n, i, order[i], geometry, outputs, summary[thread]);
      });
    }
  });
  for (const Summary& s : summary) {
    c.hash += s.hash;
    c.first_toc = std::min(c.first_toc, s.first_toc);
  }
}

}  // namespace hpccd
