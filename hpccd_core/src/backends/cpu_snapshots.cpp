// SPDX-License-Identifier: Apache-2.0
// Queries of one snapshot on CPU threads: what each of them lets the common traversal look at.
#include "backends/cpu_backend.h"
#include "contacts/gaps.h"
#include "contacts/intersections.h"
#include "elementary/distance/distance_batch.h"
#include "traverse/snapshot.h"

namespace hpccd {

std::optional<Contacts> CpuBackend::proximity(Positions vertices, double distance) {
  const Options& o = shared_.options;
  see_snapshot(vertices, distance);
  search_.geometry.separations = {distance};
  search_.leaf_pairs_in_snapshot = leaf_pairs_in_snapshot(o.simd);
  search_.reach = reach_of(distance, shared_.tree.motion().box_rounding, shared_.tree.motion().box_scale);
  walk_tree();
  return collect({false, false, o.closest, AtTime::start});
}

std::optional<Intersections> CpuBackend::intersections(Positions vertices) {
  see_snapshot(vertices);
  search_.leaf_edge_faces = leaf_edge_faces(shared_.options.simd);
  search_.reach = 0;
  walk_tree();
  Intersections found = collect_intersections(workers_, search_.geometry, order_, shared_.pool);
  shared_.profiler.mark("contacts");
  shared_.cancellation.heed();
  return found;
}

std::optional<std::vector<Gap>> CpuBackend::distances(Positions vertices) {
  const Options& o = shared_.options;
  see_snapshot(vertices);
  if (!mesh_pairs_) mesh_pairs_.emplace(shared_.rules, shared_.scene->meshes().size());
  search_.nearest =
      std::make_unique<NearestPairs>(*mesh_pairs_, shared_.features, shared_.tree.motion(), shared_.tree.tree());
  search_.leaf_pairs_in_snapshot = leaf_pairs_in_snapshot(o.simd);
  search_.far_pairs = far_pairs(o.simd);
  search_.leaf_edge_faces = leaf_edge_faces(o.simd);
  walk_tree();
  std::vector<Gap> gaps = collect_gaps(*search_.nearest, search_.geometry, shared_.cancellation);
  search_.nearest = nullptr;
  shared_.profiler.mark("contacts");
  shared_.cancellation.heed();
  return gaps;
}

void CpuBackend::see_snapshot(Positions vertices, double distance) {
  const Simd simd = shared_.options.simd;
  shared_.tree.bound(vertices, distance);
  begin_query();
  shared_.tree.fit(shared_.profiler);
  search_.report = Report::all;
  for (unsigned i = 0; i < n_rules; ++i)
    search_.batch_test[i] = proximity_batch(simd), search_.fallback[i] = decide_proximity;
  search_.intersection_batch = intersection_batch(simd);
}

}  // namespace hpccd
