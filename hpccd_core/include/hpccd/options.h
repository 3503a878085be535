// SPDX-License-Identifier: Apache-2.0
// How a Detector works. The defaults are right for most scenes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "hpccd/export.h"
#include "hpccd/scene.h"

namespace hpccd {
inline namespace v0_1 {

/// Where a step is computed. `automatic` picks the fastest that works here for this scene, and goes back to the CPU
/// where a GPU fails. hybrid: CPUs traverse, GPUs test (Kim et al. 2009, section 5). Contacts, order and hash are the
/// same on each, but at Accuracy::fast.
enum class Backend : std::uint8_t { automatic, cpu, hybrid, gpu };

/// all: every contact. first: those at the earliest time only. any: at most one, whichever is found first.
enum class Report : std::uint8_t { all, first, any };

/// How CPUs find the candidates: by the default traversal, or as published (Kim et al. 2009; its baseline, section 3.2;
/// Tang et al. 2009). Contacts are the same.
enum class Method : std::uint8_t { standard, published, naive, front };

/// Instruction sets: avx2 and avx512 of x86-64, neon of aarch64. The answers are the same with each.
enum class Simd : std::uint8_t { automatic, scalar, avx2, avx512, neon };

/// Those usable on this machine, best last. From any thread.
HPCCD_API std::vector<Simd> simd_levels();

struct Options {
  Accuracy accuracy = Accuracy::exact;
  Backend backend = Backend::automatic;
  Report report = Report::all;
  Simd simd = Simd::automatic;
  int threads = 0;  ///< 0: as many as this process may use cores; at most 1024
  // What is computed of each contact besides its features and time.
  bool points = false;
  bool normals = false;
  bool closest = false;  ///< the nearest points of both sides
  /// In units of the coordinates, finite, >= 0: report pairs that come within this Euclidean distance of each other,
  /// and when. 0: those that touch.
  double minimum_separation = 0;
  Method method = Method::standard;
  bool restructure = true;  ///< of `published` and `naive`: whether nodes that cull badly are split anew
  /// Of Backend::hybrid (Kim et al. 2009, section 5.1): the triangle index queue, how many segments and how many pairs
  /// each holds, 1 to 65,536 and 1 to 2^20; how many GPUs, 0 for all.
  std::size_t hybrid_segments = 128, hybrid_segment_pairs = 2048;
  int gpus = 0;
  /// Of Backend::gpu: profile() tells the time on the device too, by stage. The events for it cost 1 us each.
  bool gpu_stages = false;
  /// Of detect, collision_free_step and proximity. Intersections and smallest distances are of whole surfaces.
  TestedFeatures features{};
  /// Results are asked for on the device, by detect_on_device, proximity_on_device and intersections_on_device alone;
  /// it decides all pairs that it can. Refused where there is no usable GPU.
  bool results_on_device = false;
  /// So many copies of the scene, which know nothing of each other: positions hold all vertices of the first, then
  /// those of the second, ... Each is answered as if it were alone, in every bit. 1 to most_worlds.
  std::uint32_t worlds = 1;
  static constexpr std::uint32_t most_worlds = 65536;
};

}  // namespace v0_1
}  // namespace hpccd
