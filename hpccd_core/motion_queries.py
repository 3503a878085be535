# SPDX-License-Identifier: Apache-2.0
"""Queries of one motion, a part of Detector."""

from typing import Any, Generic, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core, arguments, device_arrays, device_results
from ._core import Positions
from .answers import OfMotion, OfStep
from .contacts import Contacts
from .device_arrays import DeviceArrayLike, DevicePositions
from .options import Results
from .prepared import PreparedDetection
from .worlds import answer_of


class MotionQueries(Generic[OfMotion, OfStep]):
    """What touches on the way from one set of positions to the next, and when first."""

    worlds: int | None
    results: Results
    _shape: tuple[int, ...]  # of all positions
    _rows: int
    _core: _core.Detector

    def detect(
        self, vertices_t0: ArrayLike | DeviceArrayLike, vertices_t1: ArrayLike | DeviceArrayLike, stream: object = None
    ) -> OfMotion:
        """Contacts of the motion from vertices_t0 to vertices_t1, each (V, 3) float32 or float64.

        Of W worlds (W, V, 3).
        C-contiguous arrays are read in place. Arrays in a GPU's memory (CUDA array interface or DLPack: CuPy, PyTorch,
        Warp; C-contiguous, backend "gpu" or "auto") are used there without a copy. Raises TypeError for a wrong dtype
        or a masked element, ValueError for a wrong shape or a coordinate that is NaN, infinite or beyond 1e150.
        stream: of device arrays, the CUDA stream on which they were made, a cudaStream_t as int, or an object with .ptr
        (CuPy) or .cuda_stream (PyTorch, Warp): its work so far comes first. Without it, all work on the device does. In
        both cases the answer is complete when the call returns. With results="device" it counts for arrays on the host
        too: what it still reads of an answer that nobody holds any more is not written before. A stream of another
        device, or one that is being captured into a graph, raises ValueError; so does one that is no more, where CUDA
        notices: a number that was never a stream may crash in CUDA.
        With results="device" the answer is a DeviceContacts.
        """
        found = self._of_motion("detect", vertices_t0, vertices_t1, stream)
        return cast(OfMotion, self._contacts(found))

    def collision_free_step(
        self, vertices_t0: ArrayLike | DeviceArrayLike, vertices_t1: ArrayLike | DeviceArrayLike, stream: object = None
    ) -> OfStep:
        """The largest part of the motion, in [0, 1], that is certainly free of contacts; 1.0 where nothing touches.

        Of W worlds (W,) float64, that of each.

        vertices_t0, vertices_t1: as for detect(), with the same errors. Up to, not including, the time returned nothing
        touches, or comes within the separation; 0.0 where something does so at the start. "exact" and "conservative":
        never larger than the true earliest time, at most 1e-9 smaller. "balanced" and "fast": the earliest of the times
        that detect() gives. Surfaces that pierce each other at the start without touching anywhere are no contact
        there: ask intersections(). What cannot touch before the best time so far is not looked at, whatever `report`
        is.

        Trial steps, shorter or turned, from one start: at "exact" and "conservative" the second call from there (the
        first, where the start before came again too) lists the pairs that are near, and later ones test these only. A
        start is known by its coordinates, wherever they lie, and taken for the same up to about a hundredth of an edge.
        The list is of use while vertices go no farther, until the time returned, than about an eighth of an edge; or
        farther, where neighbours go the same way: a mesh may fall, turn and bend as long as those near each other go
        apart by less than half an edge. Where they do not, each call searches anew. Other queries in between do no
        harm; a new separation ends it.
        """
        times: NDArray[np.float64] = self._of_motion("collision_free_steps", vertices_t0, vertices_t1, stream)
        return cast(OfStep, float(times[0]) if self.worlds is None else times)

    def prepare(
        self, vertices_t0: DeviceArrayLike, vertices_t1: DeviceArrayLike, room: float = 2.0, stream: object = None
    ) -> PreparedDetection:
        """detect() of these two arrays on the device without a look from the host: for CUDA graphs.

        Only with results="device", and without outputs. The arrays are read where they are each time: they must stay
        there. room: lists and rows hold so many times, 1 to 1000, what the motion that the arrays hold now takes; it is
        detected once for that. stream: as for detect(). Accuracy, rules and separations are those of now. Raises as
        detect() does, and RuntimeError where the GPU fails: no CPU stands in.
        """
        if self.results != "device":
            raise ValueError("results: prepare() leaves results on the device; use a detector with results='device'")
        for name, vertices in (("vertices_t0", vertices_t0), ("vertices_t1", vertices_t1)):
            if not device_arrays.is_on_device(vertices):
                raise TypeError(f"{name}: must be in the memory of the GPU, where it is read each time")
        room = arguments.length("room", room)
        ends = self._places(vertices_t0, vertices_t1, device_arrays.stream_number(stream))
        prepared = self._core.prepare(*self._for_core(*ends), room)
        return PreparedDetection(prepared, self.worlds, (vertices_t0, vertices_t1))

    def _contacts(self, found: Any) -> Any:
        return device_results.contacts_of(found) if self.results == "device" else answer_of(Contacts, found)

    def _of_motion(self, query: str, vertices_t0: object, vertices_t1: object, stream: object = None) -> Any:
        on_device = [device_arrays.is_on_device(v) for v in (vertices_t0, vertices_t1)]
        made_on = device_arrays.stream_number(stream)
        if all(on_device):
            return self._of_places(query, *self._places(vertices_t0, vertices_t1, made_on))
        if any(on_device):
            raise TypeError("vertices_t0, vertices_t1: one is a device array, the other is not; give both in one place")
        start = arguments.vertices("vertices_t0", vertices_t0, self._shape)
        end = arguments.vertices("vertices_t1", vertices_t1, self._shape)
        if start.dtype != end.dtype:  # widening a float32 is exact
            start, end = arguments.widened(start), arguments.widened(end)
        return getattr(self._core, query)(*(device_arrays.on_host(end, made_on) for end in (start, end)))

    def _places(
        self, vertices_t0: object, vertices_t1: object, made_on: int | None
    ) -> tuple[DevicePositions, DevicePositions]:
        return (
            device_arrays.positions("vertices_t0", vertices_t0, self._shape, made_on),
            device_arrays.positions("vertices_t1", vertices_t1, self._shape, made_on),
        )

    def _of_places(self, query: str, first: DevicePositions, second: DevicePositions) -> Any:
        return getattr(self._core, query)(*self._for_core(first, second))

    def _for_core(self, first: DevicePositions, second: DevicePositions) -> tuple[Positions, Positions]:
        if first.is_double != second.is_double:
            raise TypeError("vertices_t0, vertices_t1: device arrays must both be float32 or both be float64")
        return first.for_core(self._rows), second.for_core(self._rows)
