// SPDX-License-Identifier: Apache-2.0
// Options of a Detector. The defaults are right for most scenes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "hpccd/export.h"
#include "hpccd/scene.h"

namespace hpccd {
inline namespace v0_1 {

/// Where a step is computed. `automatic` tries the usable backends on the first frames and keeps the fastest. `hybrid`
/// traverses on CPUs and runs the narrow phase on GPUs (Kim et al. 2009, section 5). If a GPU fails, the CPU computes
/// the frame. Contacts, order and hash are the same on each backend, except at Accuracy::fast.
enum class Backend : std::uint8_t { automatic, cpu, hybrid, gpu };

/// Which contacts are reported. all: every contact. first: those at the earliest time of impact. any: at most one,
/// not necessarily the earliest.
enum class Report : std::uint8_t { all, first, any };

/// Broad phase on CPUs. standard: the default traversal. published: Kim et al. 2009. naive: their baseline,
/// section 3.2. front: Tang et al. 2009. Contacts are the same with each.
enum class Method : std::uint8_t { standard, published, naive, front };

/// Instruction sets: avx2 and avx512 on x86-64, neon on aarch64. Results are bit-identical with each.
enum class Simd : std::uint8_t { automatic, scalar, avx2, avx512, neon };

/// Instruction sets that this machine supports, fastest last. Thread-safe.
HPCCD_API std::vector<Simd> simd_levels();

/// Options of a Detector, read once by its constructor.
struct Options {
  Accuracy accuracy = Accuracy::exact;   ///< tier of all pairs of meshes without their own
  Backend backend = Backend::automatic;  ///< where steps are computed
  Report report = Report::all;           ///< which contacts are reported
  Simd simd = Simd::automatic;           ///< instruction set; automatic: the fastest one that the machine supports
  int threads = 0;                       ///< number of threads, at most 1024; 0: one per core that the process may use
  // Outputs of each contact besides its features and time.
  bool points = false;      ///< where the features meet; of intersections with edge_parameters and weights
  bool normals = false;     ///< unit normals
  bool closest = false;     ///< the nearest points of both sides
  bool weights = false;     ///< vertices, weights and approach: what a solver needs beside normals
  bool directions = false;  ///< of intersections only: how edge and face should move apart
  /// Pairs that come within this Euclidean distance of each other are contacts. In units of the coordinates, finite,
  /// >= 0. 0: pairs that touch.
  double minimum_separation = 0;
  Method method = Method::standard;  ///< broad phase on CPUs
  bool restructure = true;           ///< for `published` and `naive`: whether nodes that cull badly are rebuilt
  /// For Backend::hybrid (Kim et al. 2009, section 5.1): number of segments of the triangle index queue, 1 to 65,536.
  std::size_t hybrid_segments = 128;
  std::size_t hybrid_segment_pairs = 2048;  ///< for Backend::hybrid: pairs per segment, 1 to 2^20
  int gpus = 0;                             ///< for Backend::hybrid: number of GPUs; 0: all
  /// For Backend::gpu: profile() also contains the device time of each stage. Each event costs about 1 us.
  bool gpu_stages = false;
  /// Features that detect, collision_free_step and proximity test. Intersections and distances use whole surfaces.
  TestedFeatures features{};
  /// Results stay on the device: use detect_on_device, proximity_on_device and intersections_on_device. The constructor
  /// throws InvalidArgument without a usable GPU.
  bool results_on_device = false;
  /// Number of independent copies of the scene, 1 to most_worlds. Positions hold all vertices of the first world, then
  /// those of the second, and so on. Results are bit-identical to running each world on its own.
  std::uint32_t worlds = 1;
  static constexpr std::uint32_t most_worlds = 65536;  ///< upper bound of worlds
};

}  // namespace v0_1
}  // namespace hpccd
