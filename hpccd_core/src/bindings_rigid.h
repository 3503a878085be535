// SPDX-License-Identifier: Apache-2.0
// Python bindings of chains of joints.
#pragma once

#include <pybind11/pybind11.h>

namespace hpccd {

void bind_rigid(pybind11::module_& m);

}  // namespace hpccd
