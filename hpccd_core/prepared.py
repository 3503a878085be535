# SPDX-License-Identifier: Apache-2.0
"""Detections that a CUDA graph can hold."""

from __future__ import annotations

from typing import Any

from . import _core, device_arrays, device_results
from ._core import DeviceArray
from .array_types import Stream
from .device_results import DeviceContacts
from .mesh_layout import MeshLayout


class PreparedDetection:
    """A detection that can be repeated on the same device arrays without waiting, as a CUDA graph needs it.

    :meth:`Detector.prepare` returns it. Each :meth:`enqueue` writes to the same arrays, in stream order. Keep it as
    long as a graph that holds it.

    Attributes
    ----------
    vf, ee : DeviceArray, shapes (n, 2) and (m, 4), uint32
        As in :class:`DeviceContacts`, at full capacity; rows beyond `counts` are of earlier detections.
    toc : DeviceArray, float64
        Times of impact of the vertex-face rows, then of the edge-edge rows.
    counts : DeviceArray, shape (3,), int64
        Vertex-face rows, edge-edge rows, and a state. State 0: complete. Otherwise there are no rows, and the state is
        a sum of 1: a list was too short; 2: some pairs need the CPU; 4: a coordinate is NaN, infinite or too large;
        8: one feature touches more than 2,048 others. Call :meth:`Detector.detect` then.
    hash : DeviceArray, shape (1,), uint64
    first_toc : DeviceArray, shape (1,), float64
    vf_offsets, ee_offsets, hashes, first_tocs : DeviceArray or None
        With worlds, as in :class:`DeviceContacts`.
    points, normals, closest, vertices, weights, approach : DeviceArray
        Outputs that the detector was asked for: of the vertex-face rows, then of the edge-edge rows.
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

    def __init__(
        self,
        core: _core.PreparedDetection,
        worlds: int | None,
        vertices: tuple[object, object],
        layout: MeshLayout | None = None,
        outputs: tuple[str, ...] = (),
    ) -> None:
        if not isinstance(core, _core.PreparedDetection):
            raise TypeError("PreparedDetection: Detector.prepare() makes them")
        self._core = core
        self._n_worlds = worlds or 1
        self._layout, self._outputs = layout, outputs
        self._vertices = vertices  # which are read in place
        for name, array in core.arrays(self._n_worlds).items():
            setattr(self, name, array)

    def enqueue(self, stream: Stream = None) -> None:
        """Detect again, on the positions that the arrays hold then. Does not wait and allocates nothing.

        Parameters
        ----------
        stream : Stream, optional
            CUDA stream, the default stream if None. While it is being captured into a graph, the work becomes part of
            the graph.

        Raises
        ------
        ValueError
            If CUDA knows no such stream.
        RuntimeError
            If the GPU fails, or the stream is of another GPU.
        """
        self._core.enqueue(device_arrays.stream_number(stream) or 0)

    def contacts(self) -> DeviceContacts:
        """Wait for the device and return the last detection, in these arrays. RuntimeError if it is not complete."""
        found: Any = self._core.contacts(self._n_worlds)
        contacts = device_results.contacts_of(found, self._outputs, self._layout)
        contacts.read_slices()  # now: another detection may follow
        return contacts

    def __repr__(self) -> str:
        return f"PreparedDetection(room for {len(self.vf)} vertex-face, {len(self.ee)} edge-edge)"
