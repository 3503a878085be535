// SPDX-License-Identifier: Apache-2.0
// What the GPU backends say of options that they do not have, on any machine: with and without a GPU, in builds without
// CUDA too.
#include <gtest/gtest.h>

#include "backends/gpu_backend.h"
#include "backends/hybrid_backend.h"

namespace hpccd {
namespace {

bool names(const std::string& why, const std::string& option) { return why.starts_with(option + ":"); }

TEST(Unsupported, NothingOfTheDefaults) {
  EXPECT_EQ(GpuBackend::unsupported({}), "");
  EXPECT_EQ(HybridBackend::unsupported({}), "");
}

TEST(Unsupported, PublishedMethodsOnTheGpuAlone) {
  for (const Method method : {Method::published, Method::naive, Method::front}) {
    EXPECT_TRUE(names(GpuBackend::unsupported({.method = method}), "method"));
    EXPECT_EQ(HybridBackend::unsupported({.method = method}), "");
  }
}

TEST(Unsupported, ASeparationOnAnyGpu) {
  const Options options{.accuracy = Accuracy::conservative, .minimum_separation = 1e-3};
  EXPECT_TRUE(names(GpuBackend::unsupported(options), "minimum_separation"));
  EXPECT_TRUE(names(HybridBackend::unsupported(options), "minimum_separation"));
}

}  // namespace
}  // namespace hpccd
