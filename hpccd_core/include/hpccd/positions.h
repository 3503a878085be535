// SPDX-License-Identifier: Apache-2.0
// Where the vertices are.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "hpccd/errors.h"
#include "hpccd/export.h"

namespace hpccd {
inline namespace v0_1 {

/// Positions of all vertices of a scene at one time: n rows of x y z without gaps, float or double, in any unit (all
/// lengths of a scene are in the same). They are taken exactly as given. Every coordinate must be finite and at most
/// 1e150 in magnitude, 1e300 where one time is asked for; the call that finds another throws InvalidArgument and names
/// it.
///
/// The memory is the caller's, is only read, and only during the call.
struct Positions {
  const void* data = nullptr;
  std::size_t n = 0;
  bool is_double = true;
  bool on_device = false;  ///< data is in a GPU's memory
  /// On a device: the stream (cudaStream_t) after whose work so far they are there; without one, after all of the
  /// device's. On the host it counts where results stay on the device: rows of earlier ones that nobody holds any more
  /// are written when that work, which may still read them, has ended. One that is no stream of that device is refused
  /// where CUDA says so; an address at which there is no stream at all may crash in CUDA.
  std::optional<void*> made_on = std::nullopt;

  /// Of x y z one after the other, on the host. Throws InvalidArgument for a length that is no multiple of 3.
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
