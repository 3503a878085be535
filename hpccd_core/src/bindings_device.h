// SPDX-License-Identifier: Apache-2.0
// Python bindings of results that stay on a device.
#pragma once

#include <pybind11/pybind11.h>

#include "hpccd/hpccd.h"

namespace hpccd {

void bind_device_array(pybind11::module_& m);

// Arrays by name, as of results on the host; what a query does not give is left out.
pybind11::dict to_dict(const DeviceResults& results, std::uint32_t n_worlds);

void bind_prepared(pybind11::module_& m);

}  // namespace hpccd
