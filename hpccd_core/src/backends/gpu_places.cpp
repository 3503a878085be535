// SPDX-License-Identifier: Apache-2.0
// Points, normals and nearest points of what the GPU found.
#include <algorithm>

#include "backends/gpu_backend.h"
#include "backends/gpu_worlds.h"
#include "contacts/places.h"
#include "gpu/download.h"
#include "gpu/results_to_device.h"

namespace hpccd {
namespace {

bool any(Outputs outputs) { return outputs.points || outputs.normals || outputs.closest; }

}  // namespace

// By the device, but for the rows that only integers can tell: those by the CPU.
DeviceResults GpuBackend::with_places(gpu::FrameResult found, Outputs outputs, const Separations& separations,
                                      Positions t0, Positions t1) {
  if (!any(outputs) || found.n_vf + found.n_ee == 0) return on_device(found);
  const auto open = pipeline_->find_places(found, outputs);
  if (!open) {
    DeviceResults all = on_device(found);
    add_places(all, outputs, separations, t0, t1);
    return all;
  }
  std::vector<PairPlaces> places(open->size());
  constexpr std::size_t rows_a_piece = 8;  // as of pairs that are left to the CPU
  parallel_for(shared_.pool, places.size(), rows_a_piece, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) {
      const gpu::OpenRow& row = (*open)[i];
      UndecidedPair pair{row.row < found.n_vf ? Kind::vertex_face : Kind::edge_edge, {}, {}, row.separation};
      std::ranges::copy(row.t0, pair.t0);
      std::ranges::copy(row.t1, pair.t1);
      places[i] = pair_places(pair, row.toc, outputs);
    }
  });
  pipeline_->put_places(places);
  places_on_cpu_ = places.size();
  shared_.profiler.mark("places");
  return on_device(found);
}

void GpuBackend::add_places(Contacts& found, Outputs outputs, const Separations& separations, Positions t0,
                            Positions t1) {
  if (!any(outputs)) return;
  const bool snapshot = t0.data == t1.data;
  t0 = on_host(t0, 0), t1 = snapshot ? t0 : on_host(t1, 1);
  if (n_worlds() == 1)
    hpccd::add_places(found, outputs, shared_.features, separations, t0, t1, shared_.pool);
  else
    add_places_of_worlds(found, outputs, shared_.features, separations, t0, t1, shared_.pool);
}

// All by the CPU.
void GpuBackend::add_places(DeviceResults& found, Outputs outputs, const Separations& separations, Positions t0,
                            Positions t1) {
  places_on_cpu_ = found.n_vf + found.n_ee;
  const auto fetch = [](auto& to, const auto* from, std::size_t n) {
    to.resize(n);
    gpu::download(from, to.data(), n * sizeof to[0]);
  };
  Contacts c;
  fetch(c.vf, found.vf, found.n_vf), fetch(c.vf_toc, found.values, found.n_vf);
  fetch(c.ee, found.ee, found.n_ee), fetch(c.ee_toc, found.values + found.n_vf, found.n_ee);
  if (n_worlds() > 1) {
    fetch(c.slices.vf, found.vf_offsets, n_worlds() + 1);
    fetch(c.slices.ee, found.ee_offsets, n_worlds() + 1);
  }
  add_places(c, outputs, separations, t0, t1);
  gpu::add_places(found, c);
  shared_.profiler.mark("places");
}

}  // namespace hpccd
