# SPDX-License-Identifier: Apache-2.0
"""Where each mesh lies in the scene-wide numbering of vertices and faces."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.uint32]

#: In local indices of a side that has one index only: no second index.
NO_INDEX = 2**32 - 1


@dataclasses.dataclass(frozen=True, eq=False)
class MeshLayout:
    """Names of the K meshes in the order added, and offsets: (K+1,) int64, the last entry is the total.

    planes: (P,) uint32, the numbers of the meshes that are planes; they have no vertices.
    """

    mesh_names: tuple[str, ...]
    vertex_offsets: NDArray[np.int64]
    face_offsets: NDArray[np.int64]
    planes: Indices = dataclasses.field(default_factory=lambda: np.empty(0, np.uint32))

    @property
    def vertex_counts(self) -> list[int]:
        """Number of vertices of each mesh."""
        counts: list[int] = np.diff(self.vertex_offsets).tolist()
        return counts


@dataclasses.dataclass(frozen=True, eq=False)
class Sides:
    """Both sides of N pairs. mesh_a, mesh_b: (N,). local_a, local_b: (N, 2), local to the mesh; `NO_INDEX` where a
    side, a vertex or a face, has one index; a plane has none."""

    mesh_a: Indices
    mesh_b: Indices
    local_a: Indices
    local_b: Indices

    @classmethod
    def zeros(cls, n: int) -> Sides:
        """Arrays for n pairs."""
        zeros = np.zeros
        return cls(zeros(n, np.uint32), zeros(n, np.uint32), zeros((n, 2), np.uint32), zeros((n, 2), np.uint32))

    def fill(self, layout: MeshLayout, **pairs: Indices) -> Sides:
        """Write the sides of pairs of these kinds in this order, to arrays full of zeros."""
        begin, vertices, faces = 0, layout.vertex_offsets, layout.face_offsets
        for kind, rows in pairs.items():
            of_kind = slice(begin, begin + len(rows))
            begin += len(rows)
            split = 2 if kind in ("ee", "ef") else 1
            if split == 1:
                self.local_a[of_kind, 1] = NO_INDEX
            if kind in ("vf", "ef", "vp", "vv"):
                self.local_b[of_kind, 1] = NO_INDEX
            localise(rows[:, :split], vertices, self.mesh_a[of_kind], self.local_a[of_kind])
            if kind == "vp":
                self.mesh_b[of_kind], self.local_b[of_kind, 0] = layout.planes[rows[:, 1]], NO_INDEX
                continue
            of_b = faces if kind in ("vf", "ef") else vertices
            localise(rows[:, split:], of_b, self.mesh_b[of_kind], self.local_b[of_kind])
        if len(faces) > len(vertices):  # coarse faces of each mesh, then its own
            np.remainder(self.mesh_b, len(layout.mesh_names), out=self.mesh_b)
        return self


def mesh_of(indices: NDArray[np.integer], offsets: NDArray[np.int64]) -> NDArray[np.intp]:
    """The number of the mesh of each scene-wide index."""
    return np.searchsorted(offsets, indices, side="right") - 1


def localise(indices: Indices, offsets: NDArray[np.int64], mesh: Indices, local: Indices) -> None:
    """Write the mesh of each row and its indices local to that; the entries of one row belong to one mesh.

    indices: (n,k); mesh: (n,), full of zeros; local: (n, at least k).
    """
    if not len(indices):
        return
    # By columns: numpy is four times slower on many rows of one or two.
    if len(offsets) == 2:  # one mesh: nothing to look up
        for column in range(indices.shape[1]):
            local[:, column] = indices[:, column]
        return
    mesh[...] = mesh_of(indices[:, 0], offsets)
    # In the type of the indices: numpy would widen to 64 bits, at twice the time.
    start = offsets.astype(indices.dtype)[mesh]
    for column in range(indices.shape[1]):
        np.subtract(indices[:, column], start, out=local[:, column])
