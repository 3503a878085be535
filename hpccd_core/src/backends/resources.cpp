// SPDX-License-Identifier: Apache-2.0
#include "backends/resources.h"

#include <algorithm>
#include <utility>

#include "backends/rest_pairs.h"
#include "base/simd.h"
#include "scene/tested_features.h"

namespace hpccd {

Common::Common(std::shared_ptr<const Scene> of, const Options& wanted, int threads)
    : scene(std::move(of)),
      options(wanted),
      pool(threads),
      features(features_of(*scene, pool)),
      separations(*scene, wanted.minimum_separation),
      thickness(*scene, features),
      rules(*scene, wanted.accuracy, separations, wanted.features),
      filter(*scene, features, pairs_at_rest(*scene, features, pool.size()), pool),
      planes(*scene, wanted.accuracy, separations, thickness, filter),
      settled_(separations.version()) {
  require_some("features", wanted.features);
  if (wanted.worlds < 1 || wanted.worlds > Options::most_worlds)
    throw InvalidArgument("worlds: must lie in [1, " + std::to_string(Options::most_worlds) + "], got " +
                          std::to_string(wanted.worlds));
  options.simd = resolve(wanted.simd);
  options.threads = pool.size();
  pool.heed(cancellation);
  rules.set_thick(thickness.meshes());
}

void Common::settle() {
  rules.set_thick(thickness.meshes());
  if (settled_ == separations.version()) return;
  rules.change(separations);
  separations.settle();
  settled_ = separations.version();
}

Separations Common::separations_now() const {
  Separations now;
  now.thickness = thickness.view();
  now.may_be_zero = !(separations.first() > 0) && std::ranges::count(thickness.meshes(), Thick::some);
  if (separations.uniform()) {
    now.uniform = separations.first();
    return now;
  }
  const PairValues<double> pairs = separations.of_pairs();
  now.mesh_of_vertex = features.mesh_of_vertex.data(), now.n_meshes = pairs.n_meshes;
  if (pairs.all)
    now.of_meshes = pairs.all;
  else
    now.of_pairs = pairs;
  return now;
}

Resources::Resources(Common& all, ThreadPool& threads)
    : common(all),
      scene(all.scene),
      options(all.options),
      cancellation(all.cancellation),
      pool(threads),
      features(all.features),
      separations(all.separations),
      rules(all.rules),
      tree(*all.scene, all.features, threads) {}

}  // namespace hpccd
