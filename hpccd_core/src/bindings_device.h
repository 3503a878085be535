// SPDX-License-Identifier: Apache-2.0
// Python bindings of results that stay on a device.
#pragma once

#include <pybind11/pybind11.h>

#include <optional>
#include <vector>

#include "hpccd/hpccd.h"

namespace hpccd {

void bind_device_array(pybind11::module_& m);

// Arrays by name, as for results on the host; those that a query does not have are left out.
pybind11::dict to_dict(const DeviceResults& results, std::uint32_t n_worlds);

// The fields of the gaps of all worlds as arrays (W, P, ...), and the meshes of the P pairs. In one allocation on this
// device, or numpy arrays if there is none.
pybind11::dict to_dict(const std::vector<Gap>& gaps, std::uint32_t n_worlds, std::optional<int> device);

void bind_prepared(pybind11::module_& m);

}  // namespace hpccd
