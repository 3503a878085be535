// SPDX-License-Identifier: Apache-2.0
#include "hybrid/engine.h"

#include <algorithm>
#include <utility>

#include "elementary/undecided.h"

namespace hpccd::hybrid {
namespace {

// Two segments held by each thread and as many being sent.
std::size_t enough_segments(const Sizes& sizes, const ThreadPool& pool) {
  return std::max(sizes.segments, 4 * static_cast<std::size_t>(pool.size()));
}

}  // namespace

Engine::Engine(Communication::Devices devices, const Sizes& sizes, ThreadPool& pool)
    : devices_(std::move(devices)),
      queue_(devices_.front()->pair_memory(enough_segments(sizes, pool) * sizes.segment_pairs),
             enough_segments(sizes, pool), sizes.segment_pairs),
      supplies_(static_cast<std::size_t>(pool.size())),
      communication_(devices_, queue_, supplies_),
      pool_(pool) {
  for (SegmentSupply& supply : supplies_) sinks_.emplace_back(queue_, supply, communication_);
}

void Engine::begin_traversal(const LeafTable& leaves, std::vector<Worker>& workers) {
  for (std::size_t i = 0; i < workers.size(); ++i) {
    sinks_[i].begin();
    workers[i].sink = &sinks_[i];
  }
  communication_.begin_traversal(leaves);
}

Finished Engine::finish(std::vector<Worker>& workers, Profiler& profiler) {
  for (Worker& w : workers) w.sink = nullptr;
  for (SegmentSink& sink : sinks_) sink.flush();
  communication_.finish();
  profiler.mark("gpu_wait");
  exact_on_cpu_ = pairs_on_cpu_ = without_segment_ = 0;
  for (const SegmentSink& sink : sinks_) pairs_on_cpu_ += sink.given_back(), without_segment_ += sink.without_segment();
  Finished finished{!communication_.failed(), {}};
  if (!finished.complete) {
    finished.untested = untested();
    pairs_on_cpu_ += finished.untested.size();
    reset();
  }
  merge(workers);
  profiler.mark("gpu_merge");
  return finished;
}

void Engine::cancel(std::vector<Worker>& workers) {
  for (Worker& w : workers) w.sink = nullptr;
  communication_.cancel();
  reset();
}

// All pairs that were handed over and have not come back.
std::vector<LeafPair> Engine::untested() const {
  std::vector<LeafPair> pairs;
  for (SegmentNumber s = 0; s < queue_.size(); ++s)
    if (queue_.state(s) == SegmentState::full)
      pairs.insert(pairs.end(), queue_.pairs(s), queue_.pairs(s) + queue_.filled(s));
  return pairs;
}

void Engine::merge(std::vector<Worker>& workers) {
  const Output& output = communication_.output();
  // 20 us each: one at a time.
  parallel_for(pool_, output.undecided.size(), 1, [&](std::size_t begin, std::size_t end, int thread) {
    for (std::size_t i = begin; i < end; ++i) {
      const Candidate& pair = output.undecided[i];
      const bool separated = undecided_pair(workers[thread].search().geometry, pair).separation > 0;
      workers[thread].resolve(pair, {Accuracy::exact, separated});
    }
  });
  const std::size_t n_vf = output.vertex_face.size();
  parallel_for(pool_, n_vf + output.edge_edge.size(), 1024, [&](std::size_t begin, std::size_t end, int thread) {
    for (std::size_t i = begin; i < end; ++i)
      if (i < n_vf)
        workers[thread].report(Kind::vertex_face, output.vertex_face[i]);
      else
        workers[thread].report(Kind::edge_edge, output.edge_edge[i - n_vf]);
  });
  exact_on_cpu_ = output.undecided.size();
  for (int k = 0; k < 2; ++k) workers[0].counts[k] += output.counts[k], workers[0].ignored[k] += output.ignored[k];
}

void Engine::reset() {
  queue_.clear();
  for (SegmentSupply& supply : supplies_) supply.reset();
  for (SegmentSink& sink : sinks_) sink.reset();
}

void Engine::count(std::map<std::string, std::uint64_t>& stats) const {
  const CommunicationCounts& c = communication_.counts();
  stats["hybrid_calls"] = c.elements;
  stats["hybrid_segments"] = c.segments;
  stats["hybrid_most_queued"] = c.most_queued;
  stats["hybrid_pairs_on_cpu"] = pairs_on_cpu_;
  stats["hybrid_without_segment"] = without_segment_;
  stats["gpu_exact_on_cpu"] = exact_on_cpu_;
  for (const auto& device : devices_) device->count(stats);
}

}  // namespace hpccd::hybrid
