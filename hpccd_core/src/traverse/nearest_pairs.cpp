// SPDX-License-Identifier: Apache-2.0
#include "traverse/nearest_pairs.h"

#include <mutex>
#include <tuple>

#include "elementary/distance/proximity_test.h"
#include "traverse/leaf_hulls.h"
#include "traverse/near_corners.h"

namespace hpccd {
namespace {

// The relative amount by which the test may report a pair beyond its distance (proximity_test.h), with its margins.
// With less, the order of the pairs would affect which of two pairs is found.
constexpr double test_rounding = distance_radius + 1e-14;

}  // namespace

bool NearestPair::before(const NearestPair& other) const {
  const auto key = [](const NearestPair& p) {
    const bool intersects = p.kind == Kind::edge_face && p.distance == 0;
    return std::tuple(!intersects, p.distance, p.kind, p.first, p.second);
  };
  return key(*this) < key(other);
}

NearestPairs::NearestPairs(const MeshPairs& pairs, const PairRules& rules, const FilterView* filter,
                           const Features& features, const MotionBounds& motion, const Tree& tree,
                           const ThicknessTable& thickness, PlacedMeshes* placed)
    : pairs_(pairs),
      rules_(rules),
      filter_(filter),
      features_(features),
      motion_(motion),
      tree_(tree),
      thickness_(thickness),
      entries_(std::make_unique<Entry[]>(pairs.size())),
      placed_(placed),
      fine_(motion.spread ? std::make_unique<FineBoxes>(tree, motion) : nullptr),
      scale_(motion.box_scale),
      sums_(motion.box_rounding),
      // For a pair as large as the scene: mapped coordinates are within 2.25 of zero, so the sum of p, a and b is below
      // 14.
      rounding_(14 * test_rounding / motion.map.scale) {}

bool NearestPairs::offer(std::uint32_t mesh_a, std::uint32_t mesh_b, const NearestPair& pair) {
  Entry& entry = at(mesh_a, mesh_b);
  const std::lock_guard lock(entry.lock);
  if (!pair.before(entry.best)) return false;
  entry.best = pair;
  if (pair.kind == Kind::edge_face) {
    entry.piercing_edge.store(pair.first, std::memory_order_relaxed);
    entry.limit.store(-1, std::memory_order_relaxed);
    entry.reach.store(0, std::memory_order_relaxed);
  } else {
    // Pairs at the same distance are still needed: one of them is the first in canonical order.
    limit(entry, pair.distance * (1 + 1e-14) + rounding(mesh_a, mesh_b));
  }
  return true;
}

void NearestPairs::begin(std::uint32_t a, std::uint32_t b) {
  const std::uint32_t mesh_a = tree_.nodes[a].mesh, mesh_b = tree_.nodes[b].mesh;
  Entry& entry = at(mesh_a, mesh_b);
  if (entry.begun.exchange(true, std::memory_order_relaxed)) return;
  const FilterView* filter = rules_.rule(mesh_a, mesh_b).filtered ? filter_ : nullptr;
  const double most_lack = thickness_.even(mesh_a) && thickness_.even(mesh_b) ? 0 : lack(mesh_a, mesh_b, 0);
  const double distance = distance_of_near_corners(tree_, motion_, fine_.get(), placed_, filter, a, b) + most_lack;
  if (!(distance < std::numeric_limits<double>::infinity())) return;
  const std::lock_guard lock(entry.lock);
  // The computed distance of the nearest pair may exceed the limit by the rounding of the test; the pair must be found
  // as if there were no limit.
  limit(entry, distance * (1 + 1e-14) + 2 * rounding(mesh_a, mesh_b));
}

// For a pair as large as its two meshes, in a scene that is far larger than both.
double NearestPairs::rounding(std::uint32_t mesh_a, std::uint32_t mesh_b) const {
  if (!fine_) return rounding_;
  Extent both = motion_.extent_of_mesh(mesh_a);
  both.include(motion_.extent_of_mesh(mesh_b));
  double size = 0;
  for (int k = 0; k < 3; ++k) size = std::max(size, both.high[k] - both.low[k]);
  return std::min(rounding_, 3.01 * size * test_rounding);
}

void NearestPairs::limit(Entry& entry, double limit) {
  if (!(limit < entry.limit.load(std::memory_order_relaxed))) return;
  entry.limit.store(limit, std::memory_order_relaxed);
  // Rounded to a float, unless fine boxes are used.
  entry.reach.store(reach_of(std::min(limit, 1e30 / scale_), sums_, scale_), std::memory_order_relaxed);
}

}  // namespace hpccd
