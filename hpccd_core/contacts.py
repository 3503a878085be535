# SPDX-License-Identifier: Apache-2.0
"""The contacts of one motion step."""

import dataclasses

import numpy as np
from numpy.typing import NDArray


@dataclasses.dataclass(frozen=True)
class Contacts:
    """Contacts in canonical order: vertex-face by (vertex, face), then edge-edge by (a0, a1, b0, b1).

    vf: (N, 2) uint32, vertex and face, scene-wide indices. vf_toc: (N,) float64, times of contact in [0, 1].
    ee: (M, 4) uint32, a0<a1, b0<b1, (a0,a1)<(b0,b1), vertex indices. ee_toc: (M,) float64.
    points, normals: (N+M, 3) float64, vertex-face first; empty (0, 3) unless asked for in the detector's outputs.
    A point is the vertex, or lies on the shorter edge where the other crosses it; where edges are parallel, in the
    middle of what they share.
    A normal has length one and stands on the face, or on both edges, as they are at toc. It points to the side of the
    face on which the vertex is just before toc, or from edge a to the side on which edge b is just before toc. For
    contact at t=0 that is the side from which the straight-line motion would have come, had it begun earlier. The
    normal is zero where there is no side, because the motion is coplanar throughout (at rest on each other, or gliding
    in one plane), and where there is no direction, because at toc the face has no area, or the edges are parallel or
    points. Names do not matter: any order of corners and ends gives the same normal, edges exchanged turn it round.
    With a minimum separation a point is the midpoint of the nearest points at toc, and the normal the direction from
    face to vertex, or from edge a to edge b; where they already touch at the start, as above.
    closest: (N+M, 2, 3) float64, the nearest points of both sides at toc: of the vertex and the face, or of edge a and
    edge b; empty (0, 2, 3) unless "closest" is among the detector's outputs.
    first_toc: the earliest time, +inf where nothing touches.
    hash: 64-bit, the same for the same contacts on any backend and any number of threads.
    """

    vf: NDArray[np.uint32]
    vf_toc: NDArray[np.float64]
    ee: NDArray[np.uint32]
    ee_toc: NDArray[np.float64]
    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    closest: NDArray[np.float64]
    first_toc: float
    hash: int

    def __len__(self) -> int:
        return len(self.vf) + len(self.ee)

    def __repr__(self) -> str:
        return f"Contacts({len(self.vf)} vertex-face, {len(self.ee)} edge-edge, first at {self.first_toc:.6g})"

    @classmethod
    def none(cls) -> "Contacts":
        """No contacts at all."""
        empty = np.empty
        return cls(
            vf=empty((0, 2), np.uint32),
            vf_toc=empty(0),
            ee=empty((0, 4), np.uint32),
            ee_toc=empty(0),
            points=empty((0, 3)),
            normals=empty((0, 3)),
            closest=empty((0, 2, 3)),
            first_toc=np.inf,
            hash=0,
        )
