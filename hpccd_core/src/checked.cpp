// SPDX-License-Identifier: Apache-2.0
#include "checked.h"

#include <algorithm>
#include <string>
#include <type_traits>

#include "base/names.h"
#include "gpu/device.h"

namespace hpccd {
namespace {

template <class T>
void check_range(const char* name, T value, std::type_identity_t<T> least, std::type_identity_t<T> most) {
  if (value < least || value > most)
    throw InvalidArgument(std::string(name) + ": must lie in [" + std::to_string(least) + ", " + std::to_string(most) +
                          "], got " + std::to_string(value));
}

}  // namespace

std::shared_ptr<const Scene> checked(std::shared_ptr<const Scene> scene, const Options& o) {
  if (!scene) throw InvalidArgument("scene: is null; make one by std::make_shared<hpccd::Scene>()");
  check_accuracy(o.accuracy);
  check_name("backend", o.backend, Backend::gpu);
  check_name("report", o.report, Report::any);
  check_name("method", o.method, Method::front);
  check_name("simd", o.simd, Simd::neon);
  check_range("threads", o.threads, 0, 1024);
  check_range("hybrid_segments", o.hybrid_segments, 1, 65536);
  check_range("hybrid_segment_pairs", o.hybrid_segment_pairs, 1, 1 << 20);
  check_range("gpus", o.gpus, 0, 1024);
  if (o.results_on_device &&
      std::ranges::any_of(scene->meshes(), [](const auto& m) { return m.plane || m.options.points; }))
    throw InvalidArgument("results_on_device: planes and points are tested on the host; leave it false");
  if (o.gpus == 0 || (o.backend != Backend::hybrid && o.backend != Backend::automatic)) return scene;
  const auto here = static_cast<int>(gpu::status().devices.size());
  if (o.gpus > here)
    throw InvalidArgument("gpus: " + std::to_string(o.gpus) + " were asked for, " + std::to_string(here) +
                          " are usable here; give at most this number, or 0 for all");
  return scene;
}

void check_memory(const char* name, Positions vertices) {
  if (vertices.n > 0 && !vertices.data)
    throw InvalidArgument(std::string(name) + ": data is null, but " + std::to_string(vertices.n) +
                          " rows were named; give the address of the first");
}

}  // namespace hpccd
