// SPDX-License-Identifier: Apache-2.0
// Bindings of coarse meshes.
#pragma once

#include <pybind11/pybind11.h>

namespace hpccd {

void bind_detail(pybind11::module_& m);

}  // namespace hpccd
