// SPDX-License-Identifier: Apache-2.0
// The version of these headers. CMake and the Python wheel read it here, so that it is written once for the core.
#pragma once

#include "hpccd/export.h"

#define HPCCD_VERSION_MAJOR 0
#define HPCCD_VERSION_MINOR 1
#define HPCCD_VERSION_PATCH 0
#define HPCCD_VERSION "0.1.0"

namespace hpccd {
inline namespace v0_1 {

/// The version of the library that is linked, such as "0.1.0"; HPCCD_VERSION is that of the headers. Never null. From
/// any thread.
HPCCD_API const char* version();

}  // namespace v0_1
}  // namespace hpccd
