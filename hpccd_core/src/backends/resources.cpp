// SPDX-License-Identifier: Apache-2.0
#include "backends/resources.h"

#include <utility>

#include "base/simd.h"

namespace hpccd {

Resources::Resources(std::shared_ptr<const Scene> of, const Options& wanted, int threads)
    : scene(std::move(of)),
      options(wanted),
      pool(threads),
      features(features_of(*scene, pool)),
      rules(*scene, wanted.accuracy),
      tree(*scene, features, pool) {
  options.simd = resolve(wanted.simd);
  options.threads = pool.size();
  pool.heed(cancellation);
}

}  // namespace hpccd
