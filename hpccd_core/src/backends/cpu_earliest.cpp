// SPDX-License-Identifier: Apache-2.0
// The earliest contacts on CPU threads. Pairs known to be near give the best time so far at once, and often the answer;
// else the tree is searched for what may touch before.
#include <cmath>
#include <utility>

#include "backends/cpu_backend.h"
#include "elementary/distance/distance_batch.h"
#include "traverse/snapshot.h"

namespace hpccd {
namespace {

// Times within this of the earliest may be reported as earlier (policy.h).
constexpr double same_time = 2e-12;

// Of a typical edge: pairs that vertices of so short ways can bring together are mostly not neighbours in a mesh, of
// which there are more than of all others.
constexpr double longest_way = 1.0 / 8;
// A list is good for this as well, whatever the motion that it is made for: for the next steps of a slow scene.
constexpr double least_radius = 1.0 / 64;

}  // namespace

std::optional<double> CpuBackend::earliest(Positions t0, Positions t1) {
  find_earliest(t0, t1, true);
  shared_.cancellation.heed();
  return search_.earliest;
}

// Leaves what it found in the workers.
void CpuBackend::find_earliest(Positions t0, Positions t1, bool time_only) {
  begin_earliest(t0, t1, time_only);
  if (search_.prunes) {
    if (known_from_near_pairs()) return mark_traversal();
    if (list_near_pairs(t0)) {
      begin_earliest(t0, t1, time_only);
      if (known_from_near_pairs()) return mark_traversal();
    }
  }
  shared_.tree.fit(shared_.profiler);
  walk_tree();
  if (search_.prunes) remember_earliest();
}

void CpuBackend::begin_earliest(Positions t0, Positions t1, bool time_only) {
  see_motion(t0, t1, Tests::all_here);
  search_.report = Report::first;
  search_.time_only = time_only;
  search_.prunes = shared_.rules.promise_times();
}

// Tests the pairs that are near, and says whether that was enough. The best time so far is known then in any case.
bool CpuBackend::known_from_near_pairs() {
  if (std::exchange(near_separations_, shared_.separations.version()) != shared_.separations.version()) near_ = {};
  test_near_pairs();
  if (search_.over()) return true;
  travel_ = near_.travel(shared_.tree.motion().vertices, shared_.pool);
  return near_.complete_until(std::min(search_.earliest + same_time, 1.0), travel_);
}

void CpuBackend::test_near_pairs() {
  for (Worker& w : workers_) w.begin(search_);
  for (const NearList::Group& group : near_.groups()) {
    constexpr std::size_t grain = 256;  // 10 us, as long as it takes to wake a thread
    parallel_for(shared_.pool, group.first.size(), grain, [&](std::size_t begin, std::size_t end, int thread) {
      const std::span first(group.first), second(group.second);
      workers_[static_cast<std::size_t>(thread)].test_pairs(first.subspan(begin, end - begin),
                                                            second.subspan(begin, end - begin), group.kind, group.rule);
    });
  }
}

// Lists all pairs that the motion can bring together up to the best time so far, where these are few.
bool CpuBackend::list_near_pairs(Positions t0) {
  const double way = travel_.way * std::min(search_.earliest + same_time, 1.0);
  const double edge = typical_length(shared_.features, shared_.tree.motion().vertices);
  if (!(way <= longest_way * edge)) return false;
  // Room for motions that go farther, or begin elsewhere.
  const double radius = std::max(2 * way, least_radius * edge);
  const double distance = (shared_.separations.most() + 2 * radius) * (1 + 1e-9);
  if (!std::isfinite(distance)) return false;
  see_snapshot(t0);
  search_.geometry.separations = {distance};
  search_.leaf_pairs_in_snapshot = leaf_pairs_in_snapshot(shared_.options.simd);
  search_.reach = reach_of(distance, shared_.tree.motion().rounding, shared_.tree.motion().map.scale);
  walk_tree();
  Grouping near(shared_.features, shared_.rules);
  for (const Worker& w : workers_) {
    for (const Contact& c : w.vertex_face) near.add({c.first, c.second, Kind::vertex_face});
    for (const Contact& c : w.edge_edge) near.add({c.first, c.second, Kind::edge_edge});
  }
  near_.keep(std::move(near.groups), shared_.tree.motion().vertices, radius, shared_.pool);
  shared_.profiler.mark("near_pairs");
  return true;
}

// Some of the earliest contacts: they give the next motion its first bound.
void CpuBackend::remember_earliest() {
  constexpr std::size_t enough = 64;
  Grouping near(shared_.features, shared_.rules);
  std::size_t n = 0;
  for (const Worker& w : workers_)
    for (const auto& [list, kind] :
         {std::pair(&w.vertex_face, Kind::vertex_face), std::pair(&w.edge_edge, Kind::edge_edge)})
      for (const Contact& c : *list)
        if (c.toc <= search_.earliest && n++ < enough) near.add({c.first, c.second, kind});
  if (n > 0) near_.keep(std::move(near.groups), shared_.tree.motion().vertices, -1, shared_.pool);
}

}  // namespace hpccd
