# SPDX-License-Identifier: Apache-2.0
"""The contacts of one motion step."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from .worlds import PairsOfWorlds, Slices


@dataclasses.dataclass(frozen=True, eq=False)
class Contacts(PairsOfWorlds):
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
    face to vertex, or from edge a to edge b, when they first come within the separation; if they already touch at the
    start, the normal is as above.
    closest: (N+M, 2, 3) float64, the nearest points of both sides at toc: of the vertex and the face, or of edge a and
    edge b; empty (0, 2, 3) unless "closest" is among the detector's outputs.
    first_toc: the earliest time, +inf where nothing touches.
    hash: 64-bit, the same for the same contacts on any backend and any number of threads.
    Of a detector of W worlds: the rows of the first world, then those of the second, ...; in points, normals and
    closest first the vertex-face rows of all worlds. Indices are those of one world. vf_offsets, ee_offsets: (W+1,)
    int64, where the rows of each world begin, and N or M. first_tocs: (W,) float64; first_toc is the least of them.
    hash: the sum of each world's hash times 2 k + 1, modulo 2**64. world(k): the contacts of one world, as a detector
    of its own gives them. Without worlds it is as with one: offsets [0, N] and [0, M], one of first_tocs, world(0).
    a == b: whether all fields are equal, row by row. Contacts are not hashable; use `hash` as a key.
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
    slices: Slices | None = dataclasses.field(default=None, repr=False)

    @property
    def first_tocs(self) -> NDArray[np.float64]:
        """(W,): the earliest time of each world, +inf where nothing touches."""
        return np.array([self.first_toc]) if self.slices is None else self.slices.first_tocs

    def world(self, k: int) -> "Contacts":
        """The contacts of world k, 0 <= k < W: every array and the hash as a detector of it alone gives them."""
        k = self._world_number(k)
        if self.slices is None:
            return self
        vf, ee = self._rows_of(k)
        return Contacts(
            vf=self.vf[vf],
            vf_toc=self.vf_toc[vf],
            ee=self.ee[ee],
            ee_toc=self.ee_toc[ee],
            points=self._places_of(k, self.points),
            normals=self._places_of(k, self.normals),
            closest=self._places_of(k, self.closest),
            first_toc=float(self.slices.first_tocs[k]),
            hash=int(self.slices.hashes[k]),
        )

    def __len__(self) -> int:
        return len(self.vf) + len(self.ee)

    def __repr__(self) -> str:
        return f"Contacts({len(self.vf)} vertex-face, {len(self.ee)} edge-edge, first at {self.first_toc:.6g})"

    @classmethod
    def none(cls, worlds: int | None = None) -> "Contacts":
        """No contacts at all, of one world or of so many."""
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
            slices=None if worlds is None else Slices.of_none(worlds),
        )
