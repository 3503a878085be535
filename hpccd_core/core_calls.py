# SPDX-License-Identifier: Apache-2.0
"""The way of a snapshot from a method of Detector to the compiled core."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core, arguments, device_arrays
from .mesh_layout import MeshLayout


class SnapshotCalls:
    """What the parts of Detector for queries of one snapshot share."""

    worlds: int | None
    _shape: tuple[int, ...]  # of all positions
    _rows: int
    _core: _core.Detector
    _layout: MeshLayout
    _detailed: object | None
    _posed: list[str]  # names of the meshes that take a pose
    _n_others: int  # vertices of the meshes without a shape
    _has_shapes: bool

    def _ask(self, query: str, vertices: object, stream: object, *more: object, poses: object = None) -> Any:
        made_on = device_arrays.stream_number(stream)
        if poses is not None or vertices is None:
            return self._ask_at(query, vertices, poses, *more)
        ask = getattr(self._core, query)
        if device_arrays.is_on_device(vertices):
            place = device_arrays.positions("vertices", vertices, self._shape, made_on)
            return ask(place.for_core(self._rows), *more)
        there = arguments.vertices("vertices", vertices, self._shape, self._layout)
        return ask(device_arrays.on_host(there, made_on), *more)

    def _ask_at(self, query: str, vertices: object, poses: object, *more: object) -> Any:
        """A query of meshes at poses. vertices: of the meshes without a shape."""
        if vertices is None and poses is None and not self._has_shapes:
            raise TypeError("vertices: give positions or, for meshes that were added with a shape, poses; got neither")
        if self._detailed is not None:
            raise ValueError("poses: not offered with detail; give the positions, or make a detector without detail")
        rows = arguments.poses(poses, self._posed, self.worlds)
        return getattr(self._core, f"{query}_at")(rows, self._others(vertices), *more)

    def _others(self, vertices: object) -> NDArray[Any]:
        shape = (*self._shape[:-2], self._n_others, 3)
        if vertices is None:
            if self._n_others:
                raise TypeError(
                    "vertices: with poses, give the positions of the meshes that have no shape, here "
                    f"{self._n_others} rows"
                )
            return np.empty(shape)
        if isinstance(vertices, Mapping) or device_arrays.is_on_device(vertices):
            raise TypeError("vertices: with poses, give one array in host memory, of the meshes that have no shape")
        return arguments.positions_of_others(vertices, shape)
