// SPDX-License-Identifier: Apache-2.0
// Detections that a CUDA graph can contain.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "hpccd/export.h"

namespace hpccd {
inline namespace v0_1 {

struct DeviceResults;
class Detector;

/// Counts and state of a prepared detection, in the device's memory.
struct PreparedCounts {
  std::uint64_t vertex_face;  ///< number of vertex-face rows; 0 unless complete
  std::uint64_t edge_edge;    ///< number of edge-edge rows; 0 unless complete
  std::uint64_t state;        ///< `complete`, or a sum of the other values: then the rows are invalid
  std::uint64_t hash;         ///< as in Contacts
  double first_toc;           ///< as in Contacts

  static constexpr std::uint64_t complete = 0;         ///< the rows are those of detect_on_device
  static constexpr std::uint64_t no_room = 1;          ///< a list was too short
  static constexpr std::uint64_t left_to_cpu = 2;      ///< pairs need the CPU's integers
  static constexpr std::uint64_t bad_coordinates = 4;  ///< NaN, infinite, or too large
  static constexpr std::uint64_t too_many_of_one = 8;  ///< a feature touches more than 2,048 others
};

/// Output arrays of a prepared detection, the same for each run. All pointers except `memory` are to device memory.
struct PreparedResults {
  std::shared_ptr<const void> memory;                ///< owns all arrays below
  int device = -1;                                   ///< number of the device
  std::uint64_t room_vf = 0;                         ///< capacity of vf in rows
  std::uint64_t room_ee = 0;                         ///< capacity of ee in rows
  const std::array<std::uint32_t, 2>* vf = nullptr;  ///< vertex, face
  const std::array<std::uint32_t, 4>* ee = nullptr;  ///< the vertices of both edges
  const double* tocs = nullptr;            ///< times of impact of the vertex-face rows, then of the edge-edge rows
  const PreparedCounts* counts = nullptr;  ///< numbers of rows and state
  /// For several worlds, otherwise null; as in DeviceResults, no rows unless complete.
  const std::uint64_t* vf_offsets = nullptr;
  const std::uint64_t* ee_offsets = nullptr;  ///< as vf_offsets
  const std::uint64_t* hashes = nullptr;      ///< as vf_offsets
  const double* first_tocs = nullptr;         ///< for several worlds, otherwise null; as in DeviceResults
  /// Outputs of the vertex-face rows, then of the edge-edge rows; null unless requested, as in DeviceResults.
  const std::array<double, 3>* points = nullptr;
  const std::array<double, 3>* normals = nullptr;                 ///< as points
  const std::array<std::array<double, 3>, 2>* closest = nullptr;  ///< as points
  const std::array<std::uint32_t, 4>* vertices = nullptr;         ///< as points
  const std::array<double, 4>* weights = nullptr;                 ///< as points
  const double* approach = nullptr;                               ///< as points
};

/// A detection on fixed device arrays, created by Detector::prepare with the options and separations of that time. It
/// may outlive the detector, and must outlive the graphs that contain it. Concurrent calls wait for each other.
class HPCCD_API PreparedDetection {
 public:
  ~PreparedDetection();
  PreparedDetection(const PreparedDetection&) = delete;
  PreparedDetection& operator=(const PreparedDetection&) = delete;

  /// Enqueues one detection on a cudaStream_t of the device, or adds it to the graph that is being captured from the
  /// stream. It reads the positions when it runs. The call does not wait and allocates nothing. Detections write to the
  /// same arrays, so they must run one after the other. Throws InvalidArgument if CUDA does not know the stream, and
  /// std::runtime_error if the device fails or the stream belongs to another device.
  void enqueue(void* stream);
  /// The output arrays.
  const PreparedResults& results() const;
  /// Waits for the device and returns the contacts of the last detection, in place. Throws std::runtime_error with the
  /// cause if it was not complete.
  DeviceResults contacts() const;

 private:
  friend class Detector;
  struct HPCCD_HIDDEN Impl;
  HPCCD_HIDDEN explicit PreparedDetection(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace v0_1
}  // namespace hpccd
