// SPDX-License-Identifier: Apache-2.0
// Positions of vertices.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "hpccd/errors.h"
#include "hpccd/export.h"

namespace hpccd {
inline namespace v0_1 {

/// Positions of all vertices of a scene at one time: n contiguous rows of x y z, float or double. All lengths of a
/// scene are in the same unit, which is free. Coordinates are taken exactly as given. Each must be finite and at most
/// 1e150 in magnitude (1e300 for queries of one frame); otherwise the call throws InvalidArgument and names the
/// coordinate.
///
/// The caller owns the memory. It is only read, and only during the call.
struct Positions {
  const void* data = nullptr;  ///< n rows of three numbers
  std::size_t n = 0;           ///< number of rows
  bool is_double = true;       ///< double, else float
  bool on_device = false;      ///< data is in a GPU's memory
  /// The stream (cudaStream_t) that computes the positions: the call waits for the work enqueued there so far; without
  /// a stream, for all work on the device. With results on the device it also matters for positions on the host: the
  /// memory of earlier results that are no longer held is written only after that work, which may still read it. An
  /// invalid stream throws InvalidArgument if CUDA notices; an arbitrary address may crash in CUDA.
  std::optional<void*> made_on = std::nullopt;

  /// Positions on the host, from x y z of each vertex in turn. Throws InvalidArgument if the length is not a multiple
  /// of 3.
  static Positions of(std::span<const double> xyz) { return {xyz.data(), rows(xyz.size()), true}; }
  static Positions of(std::span<const float> xyz) { return {xyz.data(), rows(xyz.size()), false}; }

 private:
  static std::size_t rows(std::size_t numbers) {
    if (numbers % 3 != 0) throw InvalidArgument("xyz: must hold three numbers a vertex");
    return numbers / 3;
  }
};

}  // namespace v0_1
}  // namespace hpccd
