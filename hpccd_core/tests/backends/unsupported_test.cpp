// SPDX-License-Identifier: Apache-2.0
// Errors of the GPU backend for options that it does not have, on any machine: with and without a GPU, in builds
// without CUDA too.
#include <gtest/gtest.h>

#include "backends/gpu_backend.h"

namespace hpccd {
namespace {

bool names(const std::string& why, const std::string& option) { return why.starts_with(option + ":"); }

TEST(Unsupported, NothingOfTheDefaults) { EXPECT_EQ(GpuBackend::unsupported({}), ""); }

TEST(Unsupported, PublishedMethodsOnTheGpuAlone) {
  for (const Method method : {Method::published, Method::naive, Method::front})
    EXPECT_TRUE(names(GpuBackend::unsupported({.method = method}), "method"));
}

}  // namespace
}  // namespace hpccd
