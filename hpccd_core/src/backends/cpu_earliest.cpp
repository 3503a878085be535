// SPDX-License-Identifier: Apache-2.0
// The earliest contacts on CPU threads. Pairs known to be near give the best time so far at once, and often the answer;
// else the tree is searched for what may touch before.
#include <cmath>
#include <utility>

#include "backends/cpu_backend.h"
#include "elementary/distance/distance_batch.h"
#include "traverse/snapshot.h"

namespace hpccd {

std::optional<std::vector<double>> CpuBackend::earliest(Positions t0, Positions t1) {
  find_earliest(t0, t1, true);
  shared_.cancellation.heed();
  return std::vector<double>{search_.earliest};
}

// Leaves what it found in the workers.
void CpuBackend::find_earliest(Positions t0, Positions t1, bool time_only) {
  begin_earliest(t0, t1, time_only);
  if (search_.prunes) {
    if (known_from_near_pairs() || known_from_the_unlisted(time_only)) return;
    if (near_.radius().known() && near_.radius().failed(travel_))
      near_.begin_at(shared_.tree.motion().vertices, shared_.pool);
    if (!near_.radius().known() && list_near_pairs(t0)) {
      begin_earliest(t0, t1, time_only);
      if (known_from_near_pairs() || known_from_the_unlisted(time_only)) return;
    }
    limit_reach();
  }
  shared_.tree.fit(shared_.profiler);
  walk_tree();
  if (search_.prunes) remember_earliest();
}

void CpuBackend::limit_reach() {
  const double scale = shared_.tree.motion().box_scale;
  search_.two_ways = static_cast<float>(2 * travel_.way * scale);
  search_.most_reach = static_cast<float>(edge_ / 4 * scale);
}

void CpuBackend::begin_earliest(Positions t0, Positions t1, bool time_only) {
  see_motion(t0, t1, Tests::all_here);
  search_.report = Report::first;
  search_.time_only = time_only;
  search_.prunes = shared_.rules.promise_times();
}

// Tests the pairs that are near, and says whether that was enough. The best time so far is known then in any case.
bool CpuBackend::known_from_near_pairs() {
  if (std::exchange(near_separations_, shared_.separations.version()) != shared_.separations.version())
    near_ = {}, drift_of_.reset();
  test_groups(near_.hints);
  if (!search_.over()) test_groups(near_.groups());
  mark_traversal();
  if (search_.over()) return true;
  travel_ = near_.see(shared_.tree.motion().vertices, shared_.pool);
  return near_.radius().answers(search_.earliest, travel_);
}

// Leaves what it found in the workers, and nothing else.
void CpuBackend::test_groups(const std::vector<NearList::Group>& groups) {
  for (Worker& w : workers_) w.begin(search_);
  for (const NearList::Group& group : groups) {
    constexpr std::size_t grain = 256;  // 10 us, as long as it takes to wake a thread
    parallel_for(shared_.pool, group.first.size(), grain, [&](std::size_t begin, std::size_t end, int thread) {
      const std::span first(group.first), second(group.second);
      workers_[static_cast<std::size_t>(thread)].test_pairs(first.subspan(begin, end - begin),
                                                            second.subspan(begin, end - begin), group.kind, group.rule);
    });
  }
}

// Lists all pairs that the motion can bring together up to the best time so far, where these are few and asked for
// again. True: it looked, found few or not, and the motion is to be seen again.
bool CpuBackend::list_near_pairs(Positions t0) {
  edge_ = typical_length(shared_.features, shared_.tree.motion().vertices);
  if (!near_.radius().next_would_pay(travel_, edge_)) return false;
  std::optional<double> radius = radius_for(travel_, search_.earliest, edge_);
  const bool wide = !radius && edge_ > 0 && near_.radius().wider_would_pay();
  if (wide) radius = wide_radius();
  if (!radius) return false;
  const double distance = listed_distance(*radius, shared_.separations.most());
  if (!std::isfinite(distance)) return false;
  see_snapshot(t0, distance);
  search_.geometry.separations = {distance};
  search_.leaf_pairs_in_snapshot = leaf_pairs_in_snapshot(shared_.options.simd);
  search_.reach = reach_of(distance, shared_.tree.motion().box_rounding, shared_.tree.motion().box_scale);
  search_.most_found = wide ? most_listed_wide(shared_.features) : most_listed(shared_.features), search_.n_found = 0;
  walk_tree();
  if (search_.gave_up()) {
    wide ? near_.radius().gave_up_wider() : near_.radius().gave_up();
    return true;
  }
  Grouping near(shared_.features, shared_.rules);
  for (const Worker& w : workers_) {
    for (const Contact& c : w.vertex_face) near.add({c.first, c.second, Kind::vertex_face});
    for (const Contact& c : w.edge_edge) near.add({c.first, c.second, Kind::edge_edge});
  }
  near_.keep(std::move(near.groups), *radius, shared_.tree.motion().vertices, shared_.pool);
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
  near_.hints = std::move(near.groups);
}

}  // namespace hpccd
