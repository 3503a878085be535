// SPDX-License-Identifier: Apache-2.0
// Chains of joints, for Python.
#pragma once

#include <pybind11/pybind11.h>

namespace hpccd {

void bind_rigid(pybind11::module_& m);

}  // namespace hpccd
