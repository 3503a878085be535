# SPDX-License-Identifier: Apache-2.0
"""Results of queries of one snapshot."""

from __future__ import annotations

import dataclasses
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .mesh_layout import Indices, MeshLayout
from .results import WithSides, output
from .worlds import ComparedByRows, OfWorlds, PairsOfWorlds, Slices

Kind = Literal["vertex-face", "edge-edge", "edge-face", ""]


@dataclasses.dataclass(frozen=True, eq=False)
class Proximity(WithSides, PairsOfWorlds):
    """Pairs of features within a distance of each other: N vertex-face rows, then M edge-edge rows.

    :meth:`Detector.proximity` returns it. Order, equality and worlds as in :class:`Contacts`.

    Attributes
    ----------
    vf : ndarray, shape (N, 2), uint32
        Vertex and face, scene-wide indices, sorted lexicographically.
    vf_distance : ndarray, shape (N,), float64
        Euclidean distance of each row of `vf`, in the unit of the coordinates.
    ee : ndarray, shape (M, 4), uint32
        Vertices a0 a1 b0 b1 of two edges, ordered as in Contacts.
    ee_distance : ndarray, shape (M,), float64
        Euclidean distance of each row of `ee`.
    hash : int
        64-bit; the same for the same pairs and distances on any backend and with any number of threads.
    outputs : dict of str to ndarray
        The outputs that the detector was asked for; `normals`, `closest`, `vertices` and `weights` read it.
    """

    vf: Indices
    vf_distance: NDArray[np.float64]
    ee: Indices
    ee_distance: NDArray[np.float64]
    hash: int
    outputs: dict[str, NDArray[Any]] = dataclasses.field(default_factory=dict)
    slices: Slices | None = dataclasses.field(default=None, repr=False)
    layout: MeshLayout | None = dataclasses.field(default=None, repr=False, compare=False)

    @property
    def closest(self) -> NDArray[np.float64]:
        """(N+M, 2, 3) float64, vertex-face first: the nearest points of both sides.

        They are the vertex and its nearest point on the face, or the points of edge a and edge b; for parallel edges
        the middle of the stretch along which they are nearest. Raises `OutputNotComputed` unless the detector was made
        with outputs=("closest",).
        """
        return output(self.outputs, "closest")

    @property
    def normals(self) -> NDArray[np.float64]:
        """(N+M, 3) float64, vertex-face first: unit vectors from face to vertex, or from edge a to edge b.

        Zero where the distance is 0. Raises `OutputNotComputed` unless the detector was made with
        outputs=("normals",).
        """
        return output(self.outputs, "normals")

    @property
    def vertices(self) -> Indices:
        """(N+M, 4) uint32, vertex-face first: scene-wide vertices of each pair, v f0 f1 f2, or a0 a1 b0 b1.

        Raises `OutputNotComputed` unless the detector was made with outputs=("weights",).
        """
        return output(self.outputs, "vertices")

    @property
    def weights(self) -> NDArray[np.float64]:
        """(N+M, 4) float64, vertex-face first: the weights of `vertices`, as in Contacts, of the nearest points.

        The derivative of the distance with respect to the position of vertex i of a row is weights[i] times the
        normal. Raises `OutputNotComputed` unless the detector was made with outputs=("weights",).
        """
        return output(self.outputs, "weights")

    def world(self, k: int) -> Proximity:
        """The pairs of world k, 0 <= k < W, bit-identical to those of a detector of that world alone."""
        k = self._world_number(k)
        if self.slices is None:
            return self
        vf, ee = self._rows_of(k)
        return Proximity(
            vf=self.vf[vf],
            vf_distance=self.vf_distance[vf],
            ee=self.ee[ee],
            ee_distance=self.ee_distance[ee],
            hash=int(self.slices.hashes[k]),
            outputs={name: self._places_of(k, rows) for name, rows in self.outputs.items()},
            layout=self.layout,
        )

    def _pairs(self) -> tuple[Indices, Indices, Indices]:
        return self.vf, self.ee, self.ee[:0, :3]

    def __len__(self) -> int:
        return len(self.vf) + len(self.ee)

    def __repr__(self) -> str:
        return f"Proximity({len(self.vf)} vertex-face, {len(self.ee)} edge-edge)"


@dataclasses.dataclass(frozen=True, eq=False)
class Intersections(WithSides, OfWorlds):
    """Edges that intersect or touch faces. An edge and a face that share a vertex do not count.

    :meth:`Detector.intersections` returns it. Equality and worlds as in :class:`Contacts`.

    Attributes
    ----------
    ef : ndarray, shape (K, 3), uint32
        Vertices a0 < a1 of the edge, and the face; scene-wide indices, sorted lexicographically.
    hash : int
        64-bit; the same for the same pairs on any backend and with any number of threads.
    """

    ef: Indices
    hash: int
    slices: Slices | None = dataclasses.field(default=None, repr=False)
    layout: MeshLayout | None = dataclasses.field(default=None, repr=False, compare=False)

    @property
    def ef_offsets(self) -> NDArray[np.int64]:
        """(W+1,) int64: the pairs of world k are the rows ef_offsets[k] to ef_offsets[k + 1]."""
        return self._offsets("ef", len(self.ef))

    def world(self, k: int) -> Intersections:
        """The pairs of world k, 0 <= k < W, bit-identical to those of a detector of that world alone."""
        k = self._world_number(k)
        if self.slices is None:
            return self
        begin, end = self.slices.ef[k : k + 2]
        return Intersections(ef=self.ef[begin:end], hash=int(self.slices.hashes[k]), layout=self.layout)

    def _pairs(self) -> tuple[Indices, Indices, Indices]:
        none = self.ef[:0]
        return none, none, self.ef

    def __len__(self) -> int:
        return len(self.ef)

    def __repr__(self) -> str:
        return f"Intersections({len(self.ef)} edge-face)"


@dataclasses.dataclass(frozen=True, eq=False)
class Gap(ComparedByRows):
    """The smallest distance of two meshes at one time, or of the features of one mesh that share no vertex.

    :meth:`Detector.distances` returns a list of them. Gaps are equal if all fields are; they are not hashable.

    Attributes
    ----------
    mesh_a, mesh_b : str
        Names; `mesh_a` was added before `mesh_b`, or is the same.
    distance : float
        Euclidean, in the unit of the coordinates; 0 if they touch or intersect, +inf if no pair of features exists.
    kind : str
        "vertex-face", "edge-edge", "edge-face" (they intersect) or "" (no pair exists).
    features : tuple of int
        Scene-wide indices as in a row of Contacts.vf, Contacts.ee or Intersections.ef: of the nearest pairs the first
        in order, vertex-face before edge-edge.
    points : ndarray, shape (2, 3), float64
        The nearest points of both sides, in the order of `features`; shape (0, 3) if there are none.
    vertices : ndarray, shape (4,), uint32
        Scene-wide vertices of the nearest pair, as in Proximity; shape (0,) if the meshes intersect or have none.
    weights : ndarray, shape (4,), float64
        Their weights, as in Proximity, or shape (0,).
    normal : ndarray, shape (3,), float64
        As a row of Proximity.normals, or shape (0,). The derivative of `distance` with respect to the position of
        vertex i is weights[i] times the normal.
    """

    mesh_a: str
    mesh_b: str
    distance: float
    kind: Kind
    features: tuple[int, ...]
    points: NDArray[np.float64]
    vertices: Indices = dataclasses.field(default_factory=lambda: np.empty(0, np.uint32))
    weights: NDArray[np.float64] = dataclasses.field(default_factory=lambda: np.empty(0))
    normal: NDArray[np.float64] = dataclasses.field(default_factory=lambda: np.empty(0))
