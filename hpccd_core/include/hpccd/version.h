// SPDX-License-Identifier: Apache-2.0
// The version of the headers. CMake and the Python wheel read it from this file.
#pragma once

#include "hpccd/export.h"

#define HPCCD_VERSION_MAJOR 0
#define HPCCD_VERSION_MINOR 1
#define HPCCD_VERSION_PATCH 0
#define HPCCD_VERSION "0.1.0"

namespace hpccd {
inline namespace v0_1 {

/// The version of the linked library, such as "0.1.0", never null. HPCCD_VERSION is the version of the headers.
/// Thread-safe.
HPCCD_API const char* version();

}  // namespace v0_1
}  // namespace hpccd
