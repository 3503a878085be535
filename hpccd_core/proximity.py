# SPDX-License-Identifier: Apache-2.0
"""What queries of one snapshot answer."""

import dataclasses
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .worlds import ComparedByRows, OfWorlds, PairsOfWorlds, Slices


@dataclasses.dataclass(frozen=True, eq=False)
class Proximity(PairsOfWorlds):
    """Pairs of features within a distance of each other at one time, in the order of Contacts.

    vf: (N, 2) uint32, vertex and face, scene-wide indices. vf_distance: (N,) float64, their Euclidean distance.
    ee: (M, 4) uint32, a0<a1, b0<b1, (a0,a1)<(b0,b1), vertex indices. ee_distance: (M,) float64.
    closest: (N+M, 2, 3) float64, vertex-face first: the nearest points of both sides, the vertex and its foot, or those
    of edge a and edge b; where edges are parallel, in the middle of the stretch along which they are nearest. Empty
    (0, 2, 3) unless "closest" is among the detector's outputs.
    hash: 64-bit, the same for the same pairs and distances on any backend and any number of threads.
    Of a detector of many worlds: vf_offsets, ee_offsets, world(k), and rows and hash, as in Contacts. a == b as in
    Contacts.
    """

    vf: NDArray[np.uint32]
    vf_distance: NDArray[np.float64]
    ee: NDArray[np.uint32]
    ee_distance: NDArray[np.float64]
    closest: NDArray[np.float64]
    hash: int
    slices: Slices | None = dataclasses.field(default=None, repr=False)

    def world(self, k: int) -> "Proximity":
        """The pairs of world k, 0 <= k < W: every array and the hash as a detector of it alone gives them."""
        k = self._world_number(k)
        if self.slices is None:
            return self
        vf, ee = self._rows_of(k)
        return Proximity(
            vf=self.vf[vf],
            vf_distance=self.vf_distance[vf],
            ee=self.ee[ee],
            ee_distance=self.ee_distance[ee],
            closest=self._places_of(k, self.closest),
            hash=int(self.slices.hashes[k]),
        )

    def __len__(self) -> int:
        return len(self.vf) + len(self.ee)

    def __repr__(self) -> str:
        return f"Proximity({len(self.vf)} vertex-face, {len(self.ee)} edge-edge)"


@dataclasses.dataclass(frozen=True, eq=False)
class Intersections(OfWorlds):
    """Edges that pierce or touch faces at one time.

    ef: (K, 3) uint32, the edge's vertices a0<a1 and the face, scene-wide indices, sorted lexicographically. An edge and
    a face that share a vertex do not count.
    hash: 64-bit, the same for the same pairs on any backend and any number of threads.
    Of a detector of W worlds: the rows of the first world, then those of the second, ... ef_offsets: (W+1,) int64,
    where those of each world begin; world(k), hash and a == b as in Contacts.
    """

    ef: NDArray[np.uint32]
    hash: int
    slices: Slices | None = dataclasses.field(default=None, repr=False)

    @property
    def ef_offsets(self) -> NDArray[np.int64]:
        """(W+1,): the pairs of world k are the rows ef_offsets[k] to ef_offsets[k + 1]."""
        return self._offsets("ef", len(self.ef))

    def world(self, k: int) -> "Intersections":
        """The pairs of world k, 0 <= k < W: the array and the hash as a detector of it alone gives them."""
        k = self._world_number(k)
        if self.slices is None:
            return self
        begin, end = self.slices.ef[k : k + 2]
        return Intersections(ef=self.ef[begin:end], hash=int(self.slices.hashes[k]))

    def __len__(self) -> int:
        return len(self.ef)

    def __repr__(self) -> str:
        return f"Intersections({len(self.ef)} edge-face)"


@dataclasses.dataclass(frozen=True, eq=False)
class Gap(ComparedByRows):
    """The smallest distance of two meshes at one time, or of the features of one mesh that share no vertex.

    mesh_a, mesh_b: names; mesh_a was added before mesh_b, or is the same.
    distance: Euclidean; 0 where they touch or intersect; +inf where no pair of features exists.
    kind: "vertex-face", "edge-edge", "edge-face" (they intersect) or "" (no pair exists).
    features: scene-wide indices as in Contacts.vf, Contacts.ee or Intersections.ef; of pairs whose
    distances are the same double the first in order, vertex-face before edge-edge; of those that intersect the first.
    points: (2, 3) float64, the nearest points of both sides, in the order of the features; (0, 3) where there are none.
    a == b: whether all fields are equal. Gaps are not hashable.
    """

    mesh_a: str
    mesh_b: str
    distance: float
    kind: Literal["vertex-face", "edge-edge", "edge-face", ""]
    features: tuple[int, ...]
    points: NDArray[np.float64]
