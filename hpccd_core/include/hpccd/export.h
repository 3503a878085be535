// SPDX-License-Identifier: Apache-2.0
// Visibility of symbols. Everything that is not marked HPCCD_API is hidden, so it can change without breaking a
// program.
#pragma once

#define HPCCD_API __attribute__((visibility("default")))
// A hidden member of a visible class.
#define HPCCD_HIDDEN __attribute__((visibility("hidden")))
