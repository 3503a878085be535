// SPDX-License-Identifier: Apache-2.0
#include "contacts/intersections.h"

#include "contacts/hash.h"

namespace hpccd {

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

}  // namespace hpccd
