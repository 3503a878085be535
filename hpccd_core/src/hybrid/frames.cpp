// SPDX-License-Identifier: Apache-2.0
#include "hybrid/frames.h"

#include <algorithm>
#include <numeric>

#include "gpu/device.h"
#include "hybrid/devices.h"

namespace hpccd::hybrid {
namespace {

// The first contact in canonical order, where one is enough: which one does not depend on threads or devices.
void keep_first(std::vector<Worker>& workers) {
  std::vector<Contact> Worker::* const lists[2] = {&Worker::vertex_face, &Worker::edge_edge};
  bool have = false;
  for (const auto list : lists) {
    const Contact* best = nullptr;
    for (const Worker& w : workers)
      for (const Contact& f : w.*list)
        if (!best || before(f, *best)) best = &f;
    const std::vector<Contact> kept = best && !have ? std::vector<Contact>{*best} : std::vector<Contact>();
    have = have || best;
    for (Worker& w : workers) (w.*list).clear();
    workers[0].*list = kept;
  }
}

}  // namespace

std::string unsupported(const Options& options) {
  if (options.minimum_separation > 0) return "minimum_separation: not on the GPU; use backend=\"cpu\"";
  return "";
}

Frames::Frames(const Scene& scene, const Features& features, const PairRules& rules, const Options& options,
               ThreadPool& pool)
    : scene_(scene), features_(features), rules_(rules), options_(options), pool_(pool) {}

std::unique_ptr<FrameGuard> Frames::begin(Positions t0, Positions t1, std::vector<Worker>& workers,
                                          Profiler& profiler) {
  if (!engine_) try {
      const Sizes sizes{options_.hybrid_segments, options_.hybrid_segment_pairs};
      engine_ =
          std::make_unique<Engine>(cuda_devices(scene_, features_, options_.accuracy, options_.gpus), sizes, pool_);
      profiler.mark("gpu_start");
    } catch (const gpu::Error& e) {
      note_failure(e.what());
      return nullptr;
    }
  engine_->begin_frame(t0, t1);
  return std::make_unique<FrameGuard>(*engine_, workers);
}

void Frames::traverse(const Tree& tree, std::uint64_t builds, std::vector<Worker>& workers) {
  engine_->begin_traversal({&tree.leaves, &tree.face_of_slot, &tree.edge_of_slot, &tree.vertex_of_slot, builds},
                           workers);
}

void Frames::traverse_primitives(std::vector<Worker>& workers) {
  if (primitives_.empty()) list_primitives();
  engine_->begin_traversal({&primitives_, &face_of_primitive_, &features_.owned_edges, &features_.owned_vertices, 1},
                           workers);
}

void Frames::list_primitives() {
  face_of_primitive_.resize(features_.n_faces());
  std::iota(face_of_primitive_.begin(), face_of_primitive_.end(), 0u);
  for (std::uint32_t c = 0; c < features_.n_primitives(); ++c)
    primitives_.push_back({std::min(c, features_.n_faces()), std::min(c + 1, features_.n_faces()),
                           features_.first_edge[c], features_.first_edge[c + 1], features_.first_vertex[c],
                           features_.first_vertex[c + 1]});
}

bool Frames::finish(FrameGuard& frame, std::vector<Worker>& workers, const Test& test, Profiler& profiler) {
  const Finished finished = frame.finish(profiler);
  const bool complete = finished.complete;
  if (complete)
    failures_in_a_row_ = 0;
  else
    note_failure(engine_->error());
  const auto& pairs = finished.untested;
  parallel_for(pool_, pairs.size(), 64, [&](std::size_t begin, std::size_t end, int thread) {
    for (std::size_t i = begin; i < end; ++i) test(pairs[i], workers[thread]);
  });
  for (Worker& w : workers) w.flush();
  if (options_.report == Report::any) keep_first(workers);
  return complete;
}

void Frames::note_failure(const std::string& error) {
  ++fallbacks_;
  ++failures_in_a_row_;
  last_error_ = error;
}

void Frames::count(std::map<std::string, std::uint64_t>& stats) const {
  if (engine_) engine_->count(stats);
}

}  // namespace hpccd::hybrid
