# SPDX-License-Identifier: Apache-2.0
"""Smallest distances that stay in a GPU's memory (results="device")."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from . import arguments
from ._core import DeviceArray
from .device_results import ComparedOnHost
from .proximity import Gap, Inside, Kind

# Kinds in the order of the core's numbers, and how many of four features they have.
_FEATURES: dict[Kind, int] = {
    "": 0,
    "vertex-face": 2,
    "edge-edge": 4,
    "edge-face": 3,
    "vertex-plane": 2,
    "vertex-vertex": 2,
    "vertex-edge": 3,
}


@dataclasses.dataclass(frozen=True, eq=False)
class DeviceDistances(ComparedOnHost):
    """Smallest distances in a GPU's memory: a row for each of P pairs of meshes, with the fields of :class:`Gap`.

    :meth:`Detector.distances` returns it if the detector has results="device". Numbers are bit-identical to those of
    :class:`Gap`; what a :class:`Gap` leaves out is 0. With W worlds all shapes begin with W: `distance` is (W, P). All
    arrays are in one allocation, which is released after all of them are.

    Attributes
    ----------
    pairs : tuple of (str, str)
        On the host: `mesh_a` and `mesh_b` of each row, the same in all worlds.
    distance : DeviceArray, shape (P,), float64
    kind : DeviceArray, shape (P,), int32
        Index into `KINDS`: 0 no pair exists, 1 "vertex-face", 2 "edge-edge", 3 "edge-face" (they intersect).
    features : DeviceArray, shape (P, 4), uint32
        2 of a vertex and a face, 4 of two edges, 3 of an edge and a face; then zeros.
    points : DeviceArray, shape (P, 2, 3), float64
    vertices : DeviceArray, shape (P, 4), uint32
    weights : DeviceArray, shape (P, 4), float64
    normal : DeviceArray, shape (P, 3), float64
        The derivative of `distance` with respect to the position of vertex i is weights[i] times the normal: zero if
        the meshes intersect or no pair exists.
    inside : DeviceArray, shape (P,), int32
        Index into `INSIDE`: 0 None, 1 "a", 2 "b", 3 "both".

    Examples
    --------
    With a GPU and PyTorch::

        detector = hc.Detector(scene, worlds=1024, results="device")
        found = detector.distances(positions, stream=torch.cuda.current_stream())
        clearance = torch.from_dlpack(found.distance)[:, found.pairs.index(("robot", "table"))]
        intersect = torch.from_dlpack(found.kind) == found.KINDS.index("edge-face")
    """

    KINDS: ClassVar[tuple[Kind, ...]] = tuple(_FEATURES)
    INSIDE: ClassVar[tuple[Inside | None, ...]] = (None, "a", "b", "both")

    pairs: tuple[tuple[str, str], ...]
    distance: DeviceArray
    kind: DeviceArray
    features: DeviceArray
    points: DeviceArray
    vertices: DeviceArray
    weights: DeviceArray
    normal: DeviceArray
    inside: DeviceArray

    def world(self, k: int) -> DeviceDistances:
        """The distances of world k, 0 <= k < W: views."""
        k = arguments.whole_number("world", k, 0, (self._worlds or 1) - 1)
        if self._worlds is None:
            return self
        rows = {name: array.row(k) for name, array in self._arrays().items()}
        return DeviceDistances(pairs=self.pairs, **rows)

    def to_host(self) -> list[Gap] | list[list[Gap]]:
        """A copy: the list of :class:`Gap`, or W lists, that a detector with results="host" returns."""
        arrays = {name: array.to_host() for name, array in self._arrays().items()}
        if self._worlds is None:
            return _gaps(self.pairs, arrays)
        return [_gaps(self.pairs, {name: a[k] for name, a in arrays.items()}) for k in range(self._worlds)]

    @property
    def _worlds(self) -> int | None:
        shape = self.distance.shape
        return None if len(shape) == 1 else shape[0]

    def _arrays(self) -> dict[str, DeviceArray]:
        return {f.name: getattr(self, f.name) for f in dataclasses.fields(self) if f.name != "pairs"}

    def __repr__(self) -> str:
        pairs = f"{len(self.pairs)} pair{'' if len(self.pairs) == 1 else 's'} of meshes"
        return f"DeviceDistances({pairs}{'' if self._worlds is None else f' in {self._worlds} worlds'})"


def _gaps(pairs: Sequence[tuple[str, str]], arrays: dict[str, NDArray[Any]]) -> list[Gap]:
    """One for each row of these arrays."""
    gaps = []
    for row, (mesh_a, mesh_b) in enumerate(pairs):
        of = {name: array[row] for name, array in arrays.items()}
        kind = DeviceDistances.KINDS[of["kind"]]
        n_apart = 0 if kind in ("", "edge-face") else 4  # a row, or nothing of it
        gaps.append(
            Gap(
                mesh_a,
                mesh_b,
                float(of["distance"]),
                kind,
                tuple(of["features"][: _FEATURES[kind]].tolist()),
                of["points"] if kind else np.empty((0, 3)),
                of["vertices"][:n_apart],
                of["weights"][:n_apart],
                of["normal"][:n_apart],
                DeviceDistances.INSIDE[of["inside"]],
            )
        )
    return gaps


def distances_of(found: dict[str, Any], worlds: int | None, mesh_names: Sequence[str]) -> DeviceDistances:
    """Distances from what the core returns: its arrays have worlds."""
    pairs = tuple((mesh_names[a], mesh_names[b]) for a, b in found.pop("pairs"))
    distances = DeviceDistances(pairs, **found)
    return distances.world(0) if worlds is None else distances
