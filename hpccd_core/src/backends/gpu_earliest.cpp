// SPDX-License-Identifier: Apache-2.0
// The earliest contact on one GPU, as cpu_earliest.cpp finds it: from pairs known to be near, which stay on the device.
// Where these do not suffice, from all pairs: a frame without its results, whose boxes reach up to the best time so
// far.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "backends/gpu_backend.h"

namespace hpccd {

using Pairs = gpu::Pipeline::Pairs;

double GpuBackend::earliest_time(Positions t0, Positions t1) {
  const bool prunes = shared_.rules.promise_times();
  prepare_motion(t0, t1, prunes);
  if (!prunes) return run_for_earliest(t0, t1, Pairs::all, std::nullopt);
  if (std::exchange(near_separations_, shared_.separations.version()) != shared_.separations.version()) near_.forget();
  constexpr double none = std::numeric_limits<double>::infinity();
  double time = none;
  if (near_.known()) {
    time = run_for_earliest(t0, t1, Pairs::near_list, none);
    if (time <= 0 || near_.answers(time, travel_of_frame())) return time;
    near_.forget();
  }
  time = std::min(time, run_for_earliest(t0, t1, Pairs::all, time));
  pipeline_->choose_hints(time);
  const Travel travel = travel_of_frame();
  if (time <= 0 || !list_near_pairs(t0, time, travel)) pipeline_->forget_near();
  return time;
}

// Where a world is alone its search is pruned: the times are the same.
std::vector<double> GpuBackend::earliest_times(Positions t0, Positions t1) {
  prepare_motion(t0, t1, false);
  require_good(pipeline_->run_for_earliest(t0, t1, Pairs::all, std::nullopt, shared_.pool), t0, t1);
  std::vector<double> times = pipeline_->earliest_of_worlds();
  decide_motion(t0, t1, std::nullopt);
  for (const auto* list : {&decided_.vertex_face, &decided_.edge_edge})
    for (const Contact& c : *list) {
      const Kind kind = list == &decided_.edge_edge ? Kind::edge_edge : Kind::vertex_face;
      double& time = times[world_of({c.first, c.second, kind})];
      time = std::min(time, c.toc);
    }
  return times;
}

double GpuBackend::run_for_earliest(Positions t0, Positions t1, Pairs pairs, gpu::Pipeline::Best best) {
  require_good(pipeline_->run_for_earliest(t0, t1, pairs, best, shared_.pool), t0, t1);
  double time = pipeline_->earliest().time;
  if (time <= 0) return time;
  decide_motion(t0, t1, best ? std::min({time + same_time, *best + same_time, 1.0}) : 1.0);
  for (const auto* list : {&decided_.vertex_face, &decided_.edge_edge})
    for (const Contact& c : *list) time = std::min(time, c.toc);
  return time;
}

// For the motions to come, where these may begin as this one does.
bool GpuBackend::list_near_pairs(Positions t0, double time, const Travel& travel) {
  if (!near_.next_would_pay(travel, edge_)) return false;
  const std::optional<double> radius = radius_for(travel, time, edge_);
  const double distance = radius ? listed_distance(*radius, shared_.separations.most()) : 0;
  if (!radius || !std::isfinite(distance)) return false;
  prepare_snapshot(gpu::Query::proximity, t0, distance);
  require_good(pipeline_->list_near(t0, distance, most_listed(shared_.features), shared_.pool), t0, t0);
  if (pipeline_->gave_up_listing())
    near_.gave_up();
  else
    near_.set(*radius, true);
  return !pipeline_->gave_up_listing();
}

Travel GpuBackend::travel_of_frame() const {
  const gpu::EarliestTime frame = pipeline_->earliest();
  return Travel::along_axes(frame.away, frame.way);
}

}  // namespace hpccd
