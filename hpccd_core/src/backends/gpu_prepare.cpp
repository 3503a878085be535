// SPDX-License-Identifier: Apache-2.0
// Frames whose work is known beforehand (hpccd/prepared.h).
#include "backends/gpu_backend.h"

namespace hpccd {

GpuBackend::Prepared GpuBackend::prepare(Positions t0, Positions t1, double room) {
  Options options = shared_.options;
  options.gpu_stages = false;  // nobody asks, and marks would pile up
  Prepared p;
  p.pipeline = gpu::Pipeline::create(*shared_.scene, shared_.features, options, shared_.separations,
                                     gpu::status().devices.at(0).number);
  shared_.tree.bound(on_host(of_world(t0, 0), 0), on_host(of_world(t1, 0), 1), {});
  shared_.tree.build_anew();
  p.pipeline->set_tree(shared_.tree.tree());
  require_good(p.pipeline->run(t0, t1, std::nullopt, shared_.pool), t0, t1);
  p.pipeline->finish();
  p.results = p.pipeline->prepare(t0, t1, room);
  return p;
}

}  // namespace hpccd
