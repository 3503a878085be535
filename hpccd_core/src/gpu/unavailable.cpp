// SPDX-License-Identifier: Apache-2.0
// In builds without CUDA.
#include "gpu/pipeline.h"
#include "gpu/device.h"

namespace hpccd::gpu {

const Status& status() {
  static const Status s{false, "", {}, "this build holds no CUDA code: no nvcc was found when it was compiled"};
  return s;
}

void fail_after(int) {}

std::unique_ptr<Pipeline> Pipeline::create(const Scene&, const Features&, Accuracy, int, bool) {
  throw Error(status().reason);
}

}  // namespace hpccd::gpu
