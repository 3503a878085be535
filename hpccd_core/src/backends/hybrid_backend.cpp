// SPDX-License-Identifier: Apache-2.0
#include "backends/hybrid_backend.h"

#include <algorithm>
#include <numeric>

#include "gpu/device.h"
#include "hybrid/devices.h"

namespace hpccd {
namespace {

// The first contact in canonical order, for report "any": it does not depend on threads or devices.
void keep_first(std::vector<Worker>& workers) {
  std::vector<Contact> Worker::* const lists[2] = {&Worker::vertex_face, &Worker::edge_edge};
  bool have = false;
  for (const auto list : lists) {
    const Contact* best = nullptr;
    for (const Worker& w : workers)
      for (const Contact& c : w.*list)
        if (!best || before(c, *best)) best = &c;
    const std::vector<Contact> kept = best && !have ? std::vector<Contact>{*best} : std::vector<Contact>();
    have = have || best;
    for (Worker& w : workers) (w.*list).clear();
    workers[0].*list = kept;
  }
}

}  // namespace

std::optional<Detection> HybridBackend::detect(Positions t0, Positions t1) {
  if (!engine_ && !start()) return std::nullopt;
  std::vector<Worker>& workers = cpu_.workers();
  engine_->begin_frame(t0, t1);
  hybrid::FrameGuard frame(*engine_, workers);
  cpu_.update(t0, t1, CpuBackend::Tests::beside_devices);
  engine_->begin_traversal(leaves(), workers);
  cpu_.traverse();
  const hybrid::Finished finished = frame.finish(shared_.profiler);
  if (finished.complete) {
    failures_.succeeded();
  } else {
    failures_.failed(engine_->error());
    cpu_.test(finished.untested);
    shared_.profiler.mark("gpu_merge");
  }
  if (shared_.options.report == Report::any) keep_first(workers);
  return Detection{cpu_.collect(), finished.complete ? Backend::hybrid : Backend::cpu};
}

bool HybridBackend::start() {
  const Options& o = shared_.options;
  try {
    engine_ = std::make_unique<hybrid::Engine>(
        hybrid::cuda_devices(*shared_.scene, shared_.features, o.accuracy, o.features, shared_.separations,
                             shared_.common.thickness, shared_.common.filter, o.gpus),
        hybrid::Sizes{o.hybrid_segments, o.hybrid_segment_pairs}, shared_.pool);
  } catch (const gpu::Error& e) {
    failures_.failed(e.what());
    return false;
  }
  shared_.profiler.mark("gpu_start");
  return true;
}

hybrid::LeafTable HybridBackend::leaves() {
  const Features& f = shared_.features;
  if (cpu_.walks_tree()) {
    const Tree& tree = shared_.tree.tree();
    return {&tree.leaves, &tree.face_of_slot, &tree.edge_of_slot, &tree.vertex_of_slot, shared_.tree.number()};
  }
  if (primitives_.empty()) list_primitives();
  return {&primitives_, &face_of_primitive_, &f.owned_edges, &f.owned_vertices, 1};
}

void HybridBackend::list_primitives() {
  const Features& f = shared_.features;
  face_of_primitive_.resize(f.n_faces());
  std::iota(face_of_primitive_.begin(), face_of_primitive_.end(), 0u);
  for (std::uint32_t c = 0; c < f.n_primitives(); ++c)
    primitives_.push_back({std::min(c, f.n_faces()), std::min(c + 1, f.n_faces()), f.first_edge[c], f.first_edge[c + 1],
                           f.first_vertex[c], f.first_vertex[c + 1]});
}

void HybridBackend::count(std::map<std::string, std::uint64_t>& stats) const {
  if (engine_) engine_->count(stats);
}

}  // namespace hpccd
