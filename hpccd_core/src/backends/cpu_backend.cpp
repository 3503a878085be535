// SPDX-License-Identifier: Apache-2.0
#include "backends/cpu_backend.h"

#include <utility>

#include "elementary/distance/distance_batch.h"
#include "paper/primitive_pairs.h"
#include "scene/edge_sample.h"
#include "traverse/traverse.h"

namespace hpccd {

CpuBackend::CpuBackend(Resources& shared)
    : shared_(shared),
      method_(paper::engine_of(shared.options, {shared.features, shared.rules, shared.pool})),
      workers_(static_cast<std::size_t>(shared.pool.size())) {
  one_thread_.heed(shared.cancellation);
  search_.cancellation = &shared.cancellation;
}

std::optional<Detection> CpuBackend::detect(Positions t0, Positions t1) {
  if (shared_.options.report == Report::first && !method_) {
    find_earliest(t0, t1, false);
    return Detection{collect(), Backend::cpu};
  }
  update(t0, t1, Tests::all_here);
  traverse();
  return Detection{collect(), Backend::cpu};
}

void CpuBackend::update(Positions t0, Positions t1, Tests tests) {
  Profiler& profiler = shared_.profiler;
  see_motion(t0, t1, tests);
  if (method_) {
    swept_ = &shared_.tree.swept();
    method_->update(*swept_, profiler);
  } else {
    shared_.tree.fit(profiler);
  }
}

void CpuBackend::see_motion(Positions t0, Positions t1, Tests tests) {
  const Options& o = shared_.options;
  shared_.tree.bound(t0, t1, shared_.separations.largest());
  begin_query();
  search_.geometry.separations = shared_.separations_now();
  search_.geometry.margin = {shared_.separations.most() + shared_.tree.motion().rounding,
                             shared_.tree.motion().map.scale};
  search_.block_pairs = block_pairs(o.simd);
  search_.block_pairs_less_excess = block_pairs_less_excess(o.simd);
  search_.leaf_pairs_less_excess = leaf_pairs_less_excess(o.simd);
  search_.excess = Excess(shared_.tree.motion(), shared_.separations);
  search_.leaf_pairs = leaf_pairs(o.simd);
  search_.leaf_pairs_until = leaf_pairs_until(o.simd);
  search_.leaf_pairs_at_start = leaf_pairs_at_start(o.simd);
  const MotionBounds& motion = shared_.tree.motion();
  const bool rounds = floats_suffice(motion.short_edge, motion.map.scale);
  search_.geometry.rounded = rounds ? motion.rounded.data() : nullptr;
  const bool here = tests == Tests::all_here;
  search_.report = !here && o.report == Report::any ? Report::all : o.report;
  for (unsigned i = 0; i < n_rules; ++i) {
    const Rule rule = Rule::of_number(i);
    const bool as_balanced = rule.accuracy == Accuracy::fast && !(here && rounds);
    search_.batch_test[i] = rule.separated ? separation_batch(o.simd)
                                           : batch_test(o.simd, as_balanced ? Accuracy::balanced : rule.accuracy);
    search_.fallback[i] = rule.separated ? decide_separation : decide_contact;
  }
}

// With new bounds, nothing is looked at yet.
void CpuBackend::begin_query() {
  shared_.profiler.mark("bounds");
  const MotionBounds& motion = shared_.tree.motion();
  search_.geometry = {motion.vertices.data(), shared_.features.edges.data(), shared_.features.faces.data(),
                      motion.kdops.data()};
  search_.earliest = std::numeric_limits<double>::infinity();
  search_.excess = {};
  search_.leaf_pairs = nullptr, search_.leaf_pairs_in_snapshot = nullptr, search_.leaf_edge_faces = nullptr;
  search_.nearest = nullptr;
  search_.time_only = search_.prunes = false;
  search_.drift = nullptr;
  search_.most_found = std::numeric_limits<std::size_t>::max();
}

void CpuBackend::traverse() {
  if (!method_) return walk_tree();
  method_->traverse(*swept_, search_, workers_);
  mark_traversal();
}

void CpuBackend::walk_tree() {
  hpccd::traverse(shared_.tree.tree(), shared_.rules, search_, shared_.pool, workers_);
  mark_traversal();
}

void CpuBackend::mark_traversal() {
  double elementary = 0;
  for (const Worker& w : workers_) elementary += 1e3 * w.elementary_seconds;
  // Tests run inside the traversal; their share of the wall-clock time is their share of the threads' time.
  shared_.profiler.mark_split("traverse", "elementary", elementary / shared_.pool.size());
}

void CpuBackend::test(const std::vector<LeafPair>& pairs) {
  if (!method_) return test_leaves_of_tree(pairs);
  test_each(pairs, [&](LeafPair pair, Worker& worker) {
    paper::test_primitives(shared_.features, shared_.rules, *swept_, pair, worker);
  });
}

void CpuBackend::test_leaves_of_tree(const std::vector<LeafPair>& pairs) {
  test_each(pairs,
            [&](LeafPair pair, Worker& worker) { test_leaves(shared_.tree.tree(), shared_.rules, pair, worker); });
}

template <class Test>
void CpuBackend::test_each(const std::vector<LeafPair>& pairs, Test&& test) {
  constexpr std::size_t grain = 64;  // small beside a segment: all threads share what one leaves
  parallel_for(shared_.pool, pairs.size(), grain, [&](std::size_t begin, std::size_t end, int thread) {
    for (std::size_t i = begin; i < end; ++i) test(pairs[i], workers_[static_cast<std::size_t>(thread)]);
  });
  for (Worker& w : workers_) w.flush();
}

Contacts CpuBackend::collect() {
  const Options& o = shared_.options;
  return collect({o.points, o.normals, o.closest, AtTime::contact});
}

Contacts CpuBackend::collect(Outputs outputs) {
  // Handing out the work (five jobs) takes as long as the work on so many.
  constexpr std::size_t few = 1024;
  std::size_t n = 0;
  for (const Worker& w : workers_) n += w.vertex_face.size() + w.edge_edge.size();
  contacts_ = {};
  collect_contacts(workers_, search_.geometry, search_.report, outputs, order_, n < few ? one_thread_ : shared_.pool,
                   contacts_);
  shared_.profiler.mark("contacts");
  shared_.cancellation.heed();  // whoever cancelled a call shall not have to look at its answer
  return std::move(contacts_);
}

WorkCounts CpuBackend::last_counts() const {
  WorkCounts counts;
  counts.add(workers_);
  counts.near_pairs = near_.size();
  counts.asked[0] = counts.asked[1] = search_.leaf_pairs || search_.leaf_pairs_in_snapshot;
  counts.asked[2] = search_.leaf_edge_faces != nullptr;
  counts.earliest = search_.report == Report::first;
  counts.timed = search_.leaf_pairs && walks_tree();
  return counts;
}

void CpuBackend::count(std::map<std::string, std::uint64_t>& stats) const {
  std::uint64_t bytes = order_.bytes() + near_.bytes() + drift_.bytes();
  if (method_) bytes += method_->bytes();
  if (mesh_pairs_) bytes += mesh_pairs_->bytes();
  for (const Worker& w : workers_) bytes += sizeof(Worker) + w.bytes();
  stats["bytes"] += bytes;
  if (counts_of_worlds_) return counts_of_worlds_->write(stats);
  last_counts().write(stats);
  if (method_) method_->count(stats);
}

void CpuBackend::begin_worlds() { counts_of_worlds_.emplace(); }

void CpuBackend::begin_world(WorldMemory& memory, TreeBudget& trees) {
  // Of several contacts any may be the one that is found, but the same one as by a detector of this world alone.
  shared_.tree.begin_world(memory.tree, trees, shared_.options.report == Report::any);
  exchange(memory);
}

void CpuBackend::end_world(WorldMemory& memory) {
  *counts_of_worlds_ += last_counts();
  exchange(memory);
  shared_.tree.end_world();
}

void CpuBackend::exchange(WorldMemory& memory) {
  std::swap(near_, memory.near);
  std::swap(near_separations_, memory.near_separations);
  std::swap(edge_, memory.edge);
}

}  // namespace hpccd
