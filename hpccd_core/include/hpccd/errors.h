// SPDX-License-Identifier: Apache-2.0
// What calls throw, besides std::bad_alloc and std::runtime_error.
#pragma once

#include <stdexcept>

#include "hpccd/export.h"

namespace hpccd {
inline namespace v0_1 {

/// A mistake of the caller. what() begins with the name of the argument and ends with the remedy. A call that throws it
/// has changed nothing but what Detector::stats() and profile() say: the scene or the detector can be used on.
class HPCCD_API InvalidArgument : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
  ~InvalidArgument() override;
};

/// Thrown by a call that Detector::cancel() has ended, and by all later ones of that detector.
class HPCCD_API Cancelled : public std::runtime_error {
 public:
  Cancelled();
  ~Cancelled() override;
};

}  // namespace v0_1
}  // namespace hpccd
