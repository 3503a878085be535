// SPDX-License-Identifier: Apache-2.0
// The earliest contact on one GPU, as cpu_earliest.cpp finds it: from pairs known to be near, which stay on the device.
// Where these do not suffice, from all pairs: a frame without its results.
#include <algorithm>
#include <cmath>
#include <utility>

#include "backends/gpu_backend.h"

namespace hpccd {

using Pairs = gpu::Pipeline::Pairs;

double GpuBackend::earliest_time(Positions t0, Positions t1) {
  prepare_motion(t0, t1);
  if (!shared_.rules.promise_times()) return run_for_earliest(t0, t1, Pairs::all);
  if (std::exchange(near_separations_, shared_.separations.version()) != shared_.separations.version()) near_.forget();
  double time = run_for_earliest(t0, t1, Pairs::near_list);
  if (time <= 0 || near_.answers(time, travel_of_frame())) return time;
  if (list_near_pairs(t0, time)) {
    time = run_for_earliest(t0, t1, Pairs::near_list);
    if (time <= 0 || near_.answers(time, travel_of_frame())) return time;
  }
  near_.forget();
  time = run_for_earliest(t0, t1, Pairs::all);
  pipeline_->list_found(time);  // gives the next motion its first bound
  return time;
}

double GpuBackend::run_for_earliest(Positions t0, Positions t1, Pairs pairs) {
  require_good(pipeline_->run_for_earliest(t0, t1, pairs, shared_.pool), t0, t1);
  double time = pipeline_->earliest().time;
  if (time <= 0) return time;
  decide_motion(t0, t1, true);
  for (const auto* list : {&decided_.vertex_face, &decided_.edge_edge})
    for (const Contact& c : *list) time = std::min(time, c.toc);
  return time;
}

bool GpuBackend::list_near_pairs(Positions t0, double time) {
  const Travel travel = travel_of_frame();
  if (!near_.next_would_pay(travel, edge_)) return false;
  const std::optional<double> radius = radius_for(travel, time, edge_);
  const double distance = radius ? listed_distance(*radius, shared_.separations.most()) : 0;
  if (!radius || !std::isfinite(distance)) return false;
  near_.forget();
  prepare_snapshot(gpu::Query::proximity, t0, distance);
  require_good(pipeline_->list_near(t0, distance, most_listed(shared_.features), shared_.pool), t0, t0);
  if (pipeline_->gave_up_listing())
    near_.gave_up();
  else
    near_.set(*radius);
  return !pipeline_->gave_up_listing();
}

Travel GpuBackend::travel_of_frame() const {
  const gpu::EarliestTime frame = pipeline_->earliest();
  return Travel::along_axes(frame.away, frame.way);
}

}  // namespace hpccd
