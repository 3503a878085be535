// SPDX-License-Identifier: Apache-2.0
// Detections whose work is known beforehand, so that a CUDA graph can hold it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "hpccd/export.h"

namespace hpccd {
inline namespace v0_1 {

struct DeviceResults;
class Detector;

/// What such a detection tells of itself, in the device's memory.
struct PreparedCounts {
  std::uint64_t vertex_face, edge_edge;  ///< rows; none unless it is complete
  std::uint64_t state;                   ///< `complete`, or a sum of the others: then the rows mean nothing
  std::uint64_t hash;
  double first_toc;

  static constexpr std::uint64_t complete = 0;
  static constexpr std::uint64_t no_room = 1;          ///< some list was too short
  static constexpr std::uint64_t left_to_cpu = 2;      ///< some pairs are for the CPU's integers
  static constexpr std::uint64_t bad_coordinates = 4;  ///< NaN, infinite, or too large
  static constexpr std::uint64_t too_many_of_one = 8;  ///< one feature touches more than 2,048 others: room is no help
};

/// Where it writes: the same places each time. All pointers but `memory` are to the device's memory.
struct PreparedResults {
  std::shared_ptr<const void> memory;  ///< of all that follows
  int device = -1;
  std::uint64_t room_vf = 0, room_ee = 0;  ///< rows
  const std::array<std::uint32_t, 2>* vf = nullptr;
  const std::array<std::uint32_t, 4>* ee = nullptr;
  const double* tocs = nullptr;  ///< of the vertex-face rows there are, then of the others
  const PreparedCounts* counts = nullptr;
  // Of several worlds, else null: as in DeviceResults; of no rows unless it is complete.
  const std::uint64_t *vf_offsets = nullptr, *ee_offsets = nullptr, *hashes = nullptr;
  const double* first_tocs = nullptr;
};

/// Made by Detector::prepare, whose options and separations of that time it keeps; it may outlive the detector, and
/// must outlive the graphs that hold it. Calls of several threads wait for each other.
class HPCCD_API PreparedDetection {
 public:
  ~PreparedDetection();
  PreparedDetection(const PreparedDetection&) = delete;
  PreparedDetection& operator=(const PreparedDetection&) = delete;

  /// Puts one detection, of what the positions are then, on a cudaStream_t of the device; or into the graph that the
  /// stream is captured into. Does not wait, allocates nothing, never asks the CPU. All of them write to the same
  /// places: one after the other. Throws InvalidArgument for what CUDA knows as no stream, std::runtime_error where the
  /// device fails, or the stream is another device's.
  void enqueue(void* stream);
  const PreparedResults& results() const;
  /// Waits for the device; then the results of the last one, in place. Throws std::runtime_error where it was not
  /// complete, and says why.
  DeviceResults contacts() const;

 private:
  friend class Detector;
  struct HPCCD_HIDDEN Impl;
  HPCCD_HIDDEN explicit PreparedDetection(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace v0_1
}  // namespace hpccd
