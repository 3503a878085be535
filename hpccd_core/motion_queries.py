# SPDX-License-Identifier: Apache-2.0
"""Queries of one motion, a part of Detector."""

from __future__ import annotations

from typing import Any, Generic, NoReturn, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core, arguments, device_arrays, device_results
from ._core import Positions as CorePositions
from .array_types import DeviceArrayLike, Positions, Stream
from .contacts import Contacts
from .device_arrays import DevicePositions
from .free_motion import CollisionFreeMotion
from .mesh_layout import MeshLayout
from .options import Results
from .prepared import PreparedDetection
from .result_types import MotionResult, StepResult
from .results import result_of, with_outputs

_TWO_ARRAYS = "two arrays of positions; a separation is an option of Detector"


class MotionQueries(Generic[MotionResult, StepResult]):
    """Queries of the motion from one set of positions to the next."""

    worlds: int | None
    results: Results
    _shape: tuple[int, ...]  # of all positions
    _rows: int
    n_vertices: int
    _core: _core.Detector
    _layout: MeshLayout
    _outputs: tuple[str, ...]

    @arguments.hide_unnamed
    def detect(
        self, vertices_t0: Positions, vertices_t1: Positions, *unnamed: NoReturn, stream: Stream = None
    ) -> MotionResult:
        """Contacts of the straight-line motion from `vertices_t0` to `vertices_t1`.

        Parameters
        ----------
        vertices_t0, vertices_t1 : Positions, shape (V, 3), float32 or float64
            Positions, not displacements, of all vertices at both ends of the step: one array, meshes concatenated in
            the order added, or a dict {mesh name: (n, 3) array}. With W worlds, (W, V, 3). C-contiguous arrays are
            read in place, also in a GPU's memory (CUDA array interface or DLPack, backend "gpu" or "auto").
            Coordinates up to 1e150 in motions, 1e300 in queries of one snapshot.
        stream : Stream, optional
            CUDA stream that wrote the device arrays; by default all work on the device comes first. The result is
            complete when the call returns.

        Returns
        -------
        Contacts or DeviceContacts
            DeviceContacts with results="device".

        Raises
        ------
        TypeError
            If an array has the wrong dtype or masked elements.
        ValueError
            If a shape is wrong, a coordinate is NaN, infinite or too large, or a static mesh moves.
        Cancelled
            After :meth:`cancel`.
        """
        if unnamed:
            arguments.reject_unnamed("detect", _TWO_ARRAYS)
        found = self._of_motion("detect", vertices_t0, vertices_t1, stream)
        return cast(MotionResult, self._contacts(found))

    @arguments.hide_unnamed
    def collision_free_step(
        self, vertices_t0: Positions, vertices_t1: Positions, *unnamed: NoReturn, stream: Stream = None
    ) -> StepResult:
        """The largest fraction of the motion that is certainly free of contacts.

        Parameters
        ----------
        vertices_t0, vertices_t1 : Positions, shape (V, 3)
            Both are positions: for a direction of motion give vertices_t0 + direction.
        stream : Stream, optional

        Returns
        -------
        float, or ndarray of shape (W,) with worlds
            In [0, 1]: 1.0 only if there is no contact, not even at the end; 0.0 if there is one at the start. "exact"
            and "conservative": never larger than the true earliest time of impact, at most 1e-9 smaller.

        Notes
        -----
        Surfaces that intersect at the start without touching are no contact: query :meth:`intersections`. Trial steps
        from the same start are faster from the second call on, at "exact" and "conservative".
        """
        if unnamed:
            arguments.reject_unnamed("collision_free_step", _TWO_ARRAYS)
        times: NDArray[np.float64] = self._of_motion("collision_free_steps", vertices_t0, vertices_t1, stream)
        return cast(StepResult, float(times[0]) if self.worlds is None else times)

    @arguments.hide_unnamed
    def collision_free_motion(
        self,
        vertices_t0: Positions,
        vertices_t1: Positions,
        groups: ArrayLike | None = None,
        *unnamed: NoReturn,
        stream: Stream = None,
    ) -> CollisionFreeMotion:
        """Shorten the motion of each vertex until nothing touches.

        Parameters
        ----------
        vertices_t0, vertices_t1 : Positions, shape (V, 3)
            Both are positions: for displacements give vertices_t0 + displacements.
        groups : array_like, shape (V,), integer, optional
            Vertices with the same number share one factor; -1 is for a vertex on its own. For meshes that only
            translate: a group that rotates would change its shape. Worlds have the same groups.
        stream : Stream, optional

        Returns
        -------
        CollisionFreeMotion
            In host memory, computed by the CPU on every backend.

        Notes
        -----
        No factor is below 0.9 times `collision_free_step`, unless features touch in the rounded positions that this
        factor of all vertices gives. Vertices that do not move have the factor 1, or 0 if `stuck`. The returned numbers
        are tested at the detector's accuracy.

        Examples
        --------
        >>> import numpy as np
        >>> import hpccd_core as hc
        >>> scene = hc.Scene()
        >>> _ = scene.add_mesh("falling", [[0, 1, 2]])
        >>> _ = scene.add_mesh("ground", [[0, 1, 2]], static=True)
        >>> start = np.array([[0, 0, 1], [1, 0, 3], [0, 1, 3], [-5, -5, 0], [5, -5, 0], [0, 5, 0]], float)
        >>> end = start - np.repeat([[0, 0, 2], [0, 0, 0]], 3, axis=0)
        >>> motion = hc.Detector(scene).collision_free_motion(start, end)
        >>> motion.factors.round(6).tolist()  # only the first vertex falls on the ground
        [0.45, 1.0, 1.0, 1.0, 1.0, 1.0]
        """
        if unnamed:
            arguments.reject_unnamed("collision_free_motion", "two arrays of positions and the groups")
        numbers = np.empty(0, np.int64) if groups is None else arguments.group_numbers(groups, self._layout)
        vertices, factors, stuck = self._of_motion("collision_free_motion", vertices_t0, vertices_t1, stream, numbers)
        return CollisionFreeMotion(vertices.reshape(self._shape), factors.reshape(self._shape[:-1]), stuck)

    def prepare(
        self, vertices_t0: DeviceArrayLike, vertices_t1: DeviceArrayLike, room: float = 2.0, *, stream: Stream = None
    ) -> PreparedDetection:
        """A detection of these two device arrays that a CUDA graph can hold.

        Needs results="device". Accuracy, pairs and separations are those of this call.

        Parameters
        ----------
        vertices_t0, vertices_t1 : DeviceArrayLike, shape (V, 3)
            They are read in place each time, and must stay there.
        room : float
            Lists hold this many times, 1 to 1000, what the present motion needs; it is detected once to find out.
        stream : Stream, optional

        Returns
        -------
        PreparedDetection

        Raises
        ------
        RuntimeError
            If the GPU fails.
        """
        if self.results != "device":
            raise ValueError("results: prepare() leaves results on the device; use a detector with results='device'")
        for name, vertices in (("vertices_t0", vertices_t0), ("vertices_t1", vertices_t1)):
            if not device_arrays.is_on_device(vertices):
                raise TypeError(f"{name}: must be in the memory of the GPU, where it is read each time")
        room = arguments.length("room", room)
        ends = self._places(vertices_t0, vertices_t1, device_arrays.stream_number(stream))
        prepared = self._core.prepare(*self._for_core(*ends), room)
        ends_of_caller = (vertices_t0, vertices_t1)
        return PreparedDetection(prepared, self.worlds, ends_of_caller, self._layout, self._outputs)

    def _contacts(self, found: Any) -> Any:
        if self.results == "device":
            return device_results.contacts_of(found, self._outputs, self._layout)
        layout, bounds = found.pop("layout", self._layout), found.pop("bounds", None)
        found = with_outputs(found, self._outputs)
        if bounds is not None:
            found["outputs"]["bounds"] = bounds
        return result_of(Contacts, found, layout)

    def _of_motion(
        self, query: str, vertices_t0: object, vertices_t1: object, stream: object = None, *more: object
    ) -> Any:
        on_device = device_arrays.is_on_device(vertices_t0)
        made_on = device_arrays.stream_number(stream)
        if device_arrays.is_on_device(vertices_t1) != on_device:
            raise TypeError("vertices_t0, vertices_t1: one is a device array, the other is not; give both in one place")
        if on_device:
            return self._of_places(query, *self._places(vertices_t0, vertices_t1, made_on), *more)
        start = arguments.vertices("vertices_t0", vertices_t0, self._shape, self._layout)
        end = arguments.vertices("vertices_t1", vertices_t1, self._shape, self._layout)
        if start.dtype != end.dtype:  # widening a float32 is exact
            start, end = arguments.widened(start), arguments.widened(end)
        ends = device_arrays.on_host(start, made_on), device_arrays.on_host(end, made_on)
        return getattr(self._core, query)(*ends, *more)

    def _places(
        self, vertices_t0: object, vertices_t1: object, made_on: int | None
    ) -> tuple[DevicePositions, DevicePositions]:
        return (
            device_arrays.positions("vertices_t0", vertices_t0, self._shape, made_on),
            device_arrays.positions("vertices_t1", vertices_t1, self._shape, made_on),
        )

    def _of_places(self, query: str, first: DevicePositions, second: DevicePositions, *more: object) -> Any:
        return getattr(self._core, query)(*self._for_core(first, second), *more)

    def _for_core(self, first: DevicePositions, second: DevicePositions) -> tuple[CorePositions, CorePositions]:
        if first.is_double != second.is_double:
            raise TypeError("vertices_t0, vertices_t1: device arrays must both be float32 or both be float64")
        return first.for_core(self._rows), second.for_core(self._rows)
