// SPDX-License-Identifier: Apache-2.0
// Exceptions of hpccd. Calls may also throw std::bad_alloc and std::runtime_error.
#pragma once

#include <stdexcept>

#include "hpccd/export.h"

namespace hpccd {
inline namespace v0_1 {

/// An argument is invalid. what() begins with the name of the argument and ends with the remedy. The call has changed
/// nothing except the contents of Detector::stats() and profile(): the scene or the detector remains usable.
class HPCCD_API InvalidArgument : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
  ~InvalidArgument() override;
};

/// The call was ended by Detector::cancel(), or the detector had been cancelled before.
class HPCCD_API Cancelled : public std::runtime_error {
 public:
  Cancelled();
  ~Cancelled() override;
};

}  // namespace v0_1
}  // namespace hpccd
