// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>

#include "gpu/pipeline.h"
#include "hpccd/prepared.h"

namespace hpccd {

struct PreparedDetection::Impl {
  std::mutex one_call;
  std::shared_ptr<const void> detector;  // the pipeline refers to its scene and rules
  std::unique_ptr<gpu::Pipeline> pipeline;
  PreparedResults results;
};

}  // namespace hpccd
