# SPDX-License-Identifier: Apache-2.0
"""Detections whose work is known beforehand, so that a CUDA graph can hold it."""

from typing import Any

from . import _core, device_arrays, device_results
from ._core import DeviceArray
from .device_results import DeviceContacts


class PreparedDetection:
    """What Detector.prepare() gives: enqueue() detects again, in the same arrays, without waiting.

    Each enqueue() writes to the same arrays, in stream order; none of them moves. Their rows beyond those that `counts`
    tells are of earlier detections.
        vf, ee: as in DeviceContacts, with all the room there is. toc: of the vertex-face rows that there are, then of
            the edge-edge rows.
        counts: (3,) int64: vertex-face rows, edge-edge rows, state. State 0: complete. Else a sum, and there are no
            rows: 1, some list was too short; 2, some pairs are for the CPU's integers; 4, a coordinate is NaN, infinite
            or too large; 8, one feature touches more than 2,048 others. Never a part of the contacts alone: ask
            detect() then, which answers any motion.
        hash: (1,) uint64. first_toc: (1,) float64.
        vf_offsets, ee_offsets, hashes, first_tocs: of many worlds, as in DeviceContacts; else None.
    Keep it as long as a graph that holds it.
    """

    vf: DeviceArray
    ee: DeviceArray
    toc: DeviceArray
    counts: DeviceArray
    hash: DeviceArray
    first_toc: DeviceArray
    vf_offsets: DeviceArray | None
    ee_offsets: DeviceArray | None
    hashes: DeviceArray | None
    first_tocs: DeviceArray | None

    def __init__(self, core: _core.PreparedDetection, worlds: int | None, vertices: tuple[object, object]) -> None:
        if not isinstance(core, _core.PreparedDetection):
            raise TypeError("PreparedDetection: Detector.prepare() makes them")
        self._core = core
        self._n_worlds = worlds or 1
        self._vertices = vertices  # which are read in place
        for name, array in core.arrays(self._n_worlds).items():
            setattr(self, name, array)

    def enqueue(self, stream: object = None) -> None:
        """Detects what the vertices are then, after the stream's work so far; on the default stream if None.

        stream: as for detect(); while it is being captured into a graph, the work becomes a part of that. Does not wait
        and takes no memory. Raises ValueError for what CUDA knows as no stream, RuntimeError where the GPU fails or the
        stream is another one's.
        """
        self._core.enqueue(device_arrays.stream_number(stream) or 0)

    def contacts(self) -> DeviceContacts:
        """Waits for the device; then the last detection, in these arrays. Raises RuntimeError if it is not complete."""
        found: Any = self._core.contacts(self._n_worlds)
        contacts = device_results.contacts_of(found)
        contacts.read_slices()  # now: another detection may follow
        return contacts

    def __repr__(self) -> str:
        return f"PreparedDetection(room for {len(self.vf)} vertex-face, {len(self.ee)} edge-edge)"
