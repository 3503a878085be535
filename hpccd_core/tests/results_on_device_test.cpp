// SPDX-License-Identifier: Apache-2.0
// Options::results_on_device: without a GPU a detector rejects it at once; with one, no query reads on the host what is
// on the device.
#include <gtest/gtest.h>

#include <functional>

#include "gpu/device.h"
#include "grid_scene.h"

namespace hpccd {
namespace {

constexpr std::uint32_t side = 5;

// The text of the error; empty if there is none.
std::string error_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const InvalidArgument& error) {
    return error.what();
  }
  return "";
}

bool says(const std::string& error, const std::string& words) { return error.find(words) != std::string::npos; }

TEST(ResultsOnDevice, NeedAUsableGpu) {
  if (!gpu::status().devices.empty()) GTEST_SKIP() << "a GPU is usable here";
  for (const Backend backend : {Backend::automatic, Backend::cpu})
    for (const std::uint32_t worlds : {1u, 3u}) {
      const std::string error = error_of(
          [&] { Detector(test::two_sheets(side), {.backend = backend, .results_on_device = true, .worlds = worlds}); });
      EXPECT_TRUE(error.starts_with("results_on_device: needs a usable GPU")) << error;
      EXPECT_TRUE(says(error, gpu::status().reason) && says(error, "leave it false")) << error;
    }
}

TEST(ResultsOnDevice, AreNotAskedForOnTheHost) {
  if (gpu::status().devices.empty()) GTEST_SKIP() << gpu::status().reason;
  const auto start = test::sheet_positions(side, 0), end = test::sheet_positions(side, 1);
  const Positions a = test::view(start), b = test::view(end);
  // Where the device computes, and where the CPU does and its result is copied there.
  for (const Backend backend : {Backend::gpu, Backend::cpu}) {
    Detector detector(test::two_sheets(side), {.backend = backend, .results_on_device = true});
    const std::pair<const char*, std::function<void()>> asked[] = {
        {"detect_on_device()", [&] { detector.detect(a, b); }},
        {"detect_on_device()", [&] { detector.detect_in_place(a, b); }},
        {"proximity_on_device()", [&] { detector.proximity(a, 0.1); }},
        {"intersections_on_device()", [&] { detector.intersections(b); }}};
    for (const auto& [remedy, ask] : asked) {
      const std::string error = error_of(ask);
      EXPECT_TRUE(error.starts_with("results_on_device:") && says(error, remedy)) << error;
    }
    Detector here(test::two_sheets(side), {.backend = Backend::cpu});
    EXPECT_EQ(detector.detect_on_device(a, b).hash, here.detect(a, b).hash);
    EXPECT_EQ(detector.collision_free_step(a, b), here.collision_free_step(a, b));
    EXPECT_EQ(detector.distances(a).size(), here.distances(a).size());
  }
}

TEST(ResultsOnDevice, AreOnTheHostUnlessAskedFor) {
  const auto start = test::sheet_positions(side, 0), end = test::sheet_positions(side, 1);
  const Positions a = test::view(start), b = test::view(end);
  Detector detector(test::two_sheets(side), {.backend = Backend::cpu});
  for (const std::function<void()>& ask : {std::function<void()>([&] { detector.detect_on_device(a, b); }),
                                           std::function<void()>([&] { detector.proximity_on_device(a, 0.1); }),
                                           std::function<void()>([&] { detector.intersections_on_device(a); })}) {
    const std::string error = error_of(ask);
    EXPECT_TRUE(error.starts_with("results_on_device:") && says(error, "without _on_device")) << error;
  }
  EXPECT_NO_THROW(detector.detect(a, b));
}

}  // namespace
}  // namespace hpccd
