// SPDX-License-Identifier: Apache-2.0
// Options with several names. A value from a file or another language may be any number.
#pragma once

#include <string>

#include "hpccd/hpccd.h"

namespace hpccd {

// Throws InvalidArgument if `value` is not one of the names; `last` is the last one.
template <class Enum>
void check_name(const char* name, Enum value, Enum last) {
  if (value > last)
    throw InvalidArgument(std::string(name) + ": " + std::to_string(static_cast<unsigned>(value)) +
                          " is none of its names; see hpccd/options.h");
}

inline void check_accuracy(Accuracy accuracy) { check_name("accuracy", accuracy, Accuracy::exact); }

}  // namespace hpccd
