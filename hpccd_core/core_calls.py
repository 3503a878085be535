# SPDX-License-Identifier: Apache-2.0
"""The way of a snapshot from a method of Detector to the compiled core."""

from __future__ import annotations

from typing import Any

from . import _core, arguments, device_arrays
from .mesh_layout import MeshLayout


class SnapshotCalls:
    """What the parts of Detector for queries of one snapshot share."""

    worlds: int | None
    _shape: tuple[int, ...]  # of all positions
    _rows: int
    _core: _core.Detector
    _layout: MeshLayout

    def _ask(self, query: str, vertices: object, stream: object, *more: object) -> Any:
        made_on = device_arrays.stream_number(stream)
        ask = getattr(self._core, query)
        if device_arrays.is_on_device(vertices):
            place = device_arrays.positions("vertices", vertices, self._shape, made_on)
            return ask(place.for_core(self._rows), *more)
        there = arguments.vertices("vertices", vertices, self._shape, self._layout)
        return ask(device_arrays.on_host(there, made_on), *more)
