// SPDX-License-Identifier: Apache-2.0
// What the shared library shows. All else is hidden, so that it can change without breaking a program.
#pragma once

#define HPCCD_API __attribute__((visibility("default")))
// Of a class that is shown, a part that is not.
#define HPCCD_HIDDEN __attribute__((visibility("hidden")))
