# SPDX-License-Identifier: Apache-2.0
"""Fields of a message as arrays in their shapes, checked."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def field(message: Any, name: str, dtype: type[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    """A view of the field. Raises ValueError where it has another number of values."""
    flat = np.frombuffer(getattr(message, name), dtype)
    if flat.size != np.prod(shape):
        raise ValueError(f"message: {name} has {flat.size} values, {np.prod(shape)} were expected for shape {shape}")
    return flat.reshape(shape)


def meshes_of(message: Any, name: str, count: int) -> NDArray[np.uint32]:
    """A field of ``count`` indices into mesh_names. Raises ValueError where one is beyond these."""
    meshes = field(message, name, np.uint32, (count,))
    if (meshes >= len(message.mesh_names)).any():
        raise ValueError(f"message: {name} names a mesh beyond the {len(message.mesh_names)} of mesh_names")
    return meshes
