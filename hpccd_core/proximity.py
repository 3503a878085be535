# SPDX-License-Identifier: Apache-2.0
"""What queries of one snapshot answer."""

import dataclasses
from typing import Literal

import numpy as np
from numpy.typing import NDArray


@dataclasses.dataclass(frozen=True)
class Proximity:
    """Pairs of features within a distance of each other at one time, in the order of Contacts.

    vf: (N, 2) uint32, vertex and face, scene-wide indices. vf_distance: (N,) float64, their Euclidean distance.
    ee: (M, 4) uint32, a0<a1, b0<b1, (a0,a1)<(b0,b1), vertex indices. ee_distance: (M,) float64.
    closest: (N+M, 2, 3) float64, vertex-face first: the nearest points of both sides, the vertex and its foot, or those
    of edge a and edge b; where edges are parallel, in the middle of the stretch along which they are nearest. Empty
    (0, 2, 3) unless "closest" is among the detector's outputs.
    hash: 64-bit, the same for the same pairs and distances on any backend and any number of threads.
    """

    vf: NDArray[np.uint32]
    vf_distance: NDArray[np.float64]
    ee: NDArray[np.uint32]
    ee_distance: NDArray[np.float64]
    closest: NDArray[np.float64]
    hash: int

    def __len__(self) -> int:
        return len(self.vf) + len(self.ee)

    def __repr__(self) -> str:
        return f"Proximity({len(self.vf)} vertex-face, {len(self.ee)} edge-edge)"


@dataclasses.dataclass(frozen=True)
class Intersections:
    """Edges that pierce or touch faces at one time.

    ef: (K, 3) uint32, the edge's vertices a0<a1 and the face, scene-wide indices, sorted lexicographically. An edge and
    a face that share a vertex do not count.
    hash: 64-bit, the same for the same pairs on any backend and any number of threads.
    """

    ef: NDArray[np.uint32]
    hash: int

    def __len__(self) -> int:
        return len(self.ef)

    def __repr__(self) -> str:
        return f"Intersections({len(self.ef)} edge-face)"


@dataclasses.dataclass(frozen=True)
class Gap:
    """The smallest distance of two meshes at one time, or of the features of one mesh that share no vertex.

    mesh_a, mesh_b: names; mesh_a was added before mesh_b, or is the same.
    distance: Euclidean; 0 where they touch or intersect; +inf where no pair of features exists.
    kind: "vertex-face", "edge-edge", "edge-face" (they intersect) or "" (no pair exists).
    features: scene-wide indices as in Contacts.vf, Contacts.ee or Intersections.ef; of pairs whose
    distances are the same double the first in order, vertex-face before edge-edge; of those that intersect the first.
    points: (2, 3) float64, the nearest points of both sides, in the order of the features; (0, 3) where there are none.
    """

    mesh_a: str
    mesh_b: str
    distance: float
    kind: Literal["vertex-face", "edge-edge", "edge-face", ""]
    features: tuple[int, ...]
    points: NDArray[np.float64]
