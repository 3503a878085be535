// SPDX-License-Identifier: Apache-2.0
// Python bindings of results that stay on a device.
#pragma once

#include <pybind11/pybind11.h>

#include "hpccd/hpccd.h"

namespace hpccd {

void bind_device_array(pybind11::module_& m);

// Arrays by name, as for results on the host; those that a query does not have are left out.
pybind11::dict to_dict(const DeviceResults& results, std::uint32_t n_worlds);

void bind_prepared(pybind11::module_& m);

}  // namespace hpccd
