// SPDX-License-Identifier: Apache-2.0
#include "backends/resources.h"

#include <utility>

#include "base/simd.h"
#include "scene/tested_features.h"

namespace hpccd {

Resources::Resources(std::shared_ptr<const Scene> of, const Options& wanted, int threads)
    : scene(std::move(of)),
      options(wanted),
      pool(threads),
      features(features_of(*scene, pool)),
      separations(*scene, wanted.minimum_separation),
      rules(*scene, wanted.accuracy, separations, wanted.features),
      tree(*scene, features, pool),
      settled_(separations.version()) {
  require_some("features", wanted.features);
  options.simd = resolve(wanted.simd);
  options.threads = pool.size();
  pool.heed(cancellation);
}

void Resources::settle() {
  if (settled_ == separations.version()) return;
  separations.settle();
  rules.change(separations);
  settled_ = separations.version();
}

Separations Resources::separations_now() const {
  if (separations.uniform()) return {separations.first()};
  return {0, separations.all().data(), features.mesh_of_vertex.data(),
          static_cast<std::uint32_t>(scene->meshes().size())};
}

}  // namespace hpccd
