# SPDX-License-Identifier: Apache-2.0
"""Short names for what arguments accept, as signatures and documentation print them."""

from __future__ import annotations

from collections.abc import Mapping

from numpy.typing import ArrayLike

from .device_arrays import DeviceArrayLike

#: Positions of all vertices: (V, 3) float32 or float64; {mesh name: array}; or an array in a GPU's memory.
Positions = ArrayLike | Mapping[str, ArrayLike] | DeviceArrayLike
#: A mesh of a scene, by name or number.
MeshName = str | int
#: A CUDA stream: a cudaStream_t as int, or an object with .ptr (CuPy) or .cuda_stream (PyTorch, Warp).
Stream = object
#: The option `detail`: of all meshes, or by mesh.
Detail = float | Mapping[str | int, float | Mapping[str, object]]

__all__ = ["ArrayLike", "Detail", "DeviceArrayLike", "MeshName", "Positions", "Stream"]
