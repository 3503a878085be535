// SPDX-License-Identifier: Apache-2.0
#include "traverse/nearest_pairs.h"

#include <mutex>
#include <tuple>

#include "elementary/distance/proximity_test.h"
#include "traverse/snapshot.h"

namespace hpccd {

bool NearestPair::before(const NearestPair& other) const {
  const auto key = [](const NearestPair& p) {
    const bool intersects = p.kind == Kind::edge_face && p.distance == 0;
    return std::tuple(!intersects, p.distance, p.kind, p.first, p.second);
  };
  return key(*this) < key(other);
}

NearestPairs::NearestPairs(const MeshPairs& pairs, const Features& features, const MotionBounds& motion,
                           const Tree& tree)
    : pairs_(pairs),
      features_(features),
      tree_(tree),
      entries_(std::make_unique<Entry[]>(pairs.size())),
      least_edge_(tree.nodes.size(), Tree::none),
      scale_(motion.map.scale),
      sums_(motion.rounding),
      // By how much the test may report a pair beyond its distance (proximity_test.h), and its margins, of a pair as
      // large as the scene: boxes lie within 2.25 of zero, so p, a and b together are below 14. With less, which of two
      // pairs is found would depend on which came first.
      rounding_(14 * (distance_radius + 1e-14) / motion.map.scale) {
  for (std::size_t i = tree.nodes.size(); i-- > 0;) {  // children come after their parents
    const Node& node = tree.nodes[i];
    if (node.children) {
      least_edge_[i] = least_edge(node.children, node.children + 1);
      continue;
    }
    const LeafRange& leaf = tree.leaves[node.leaf];
    for (std::uint32_t slot = leaf.first_edge; slot < leaf.end_edge; ++slot)
      least_edge_[i] = std::min(least_edge_[i], tree.edge_of_slot[slot]);
  }
}

void NearestPairs::offer(std::uint32_t mesh_a, std::uint32_t mesh_b, const NearestPair& pair) {
  Entry& entry = at(mesh_a, mesh_b);
  const std::lock_guard lock(entry.lock);
  if (!pair.before(entry.best)) return;
  entry.best = pair;
  const bool intersects = pair.kind == Kind::edge_face;
  // Pairs at the same distance are still wanted, one of which is the first in order.
  if (intersects) entry.piercing_edge.store(pair.first, std::memory_order_relaxed);
  entry.limit.store(intersects ? -1 : pair.distance * (1 + 1e-14) + rounding_, std::memory_order_relaxed);
  entry.reach.store(intersects ? 0 : reach_of(pair.distance * (1 + 1e-14) + rounding_, sums_, scale_),
                    std::memory_order_relaxed);
}

}  // namespace hpccd
