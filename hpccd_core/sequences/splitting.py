# SPDX-License-Identifier: Apache-2.0
"""Connected components of meshes as meshes of their own."""

import numpy as np
from numpy.typing import NDArray

from ..solids import closed
from .sequence import FrameSequence, SequenceError, SequenceMesh

_MOST = 64  # components of a mesh: each pair of meshes is a row of the report


class SplitSequence(FrameSequence):
    """Another sequence, whose meshes NAME become NAME.0, NAME.1, ... by their first vertices.

    Parameters
    ----------
    whole : FrameSequence
        The sequence.
    """

    def __init__(self, whole: FrameSequence) -> None:
        self._whole = whole
        note = "connected components are meshes of their own; vertices of no face are left out"
        super().__init__(whole.source, whole.n_frames, (*whole.notes, note), whole.missing, whole.up)

    def _read(self, index: int) -> tuple[str, tuple[SequenceMesh, ...], NDArray[np.float64]]:
        frame = self._whole.frame(index)
        if self._opened.get("of") is not frame.meshes:
            self._opened["parts"] = _parts(frame.name, frame.meshes)
            self._opened["of"] = frame.meshes
        meshes, order = self._opened["parts"]
        return frame.name, meshes, frame.vertices[order]


def has_closed_parts(mesh: SequenceMesh) -> bool:
    """Whether a mesh has several connected components, not too many to be split, of which one or more are closed."""
    of_face = _roots(mesh)[mesh.faces[:, 0]]
    components = np.unique(of_face)
    return 1 < len(components) <= _MOST and any(closed(mesh.faces[of_face == root]) for root in components)


def _parts(where: str, meshes: tuple[SequenceMesh, ...]) -> tuple[tuple[SequenceMesh, ...], NDArray[np.intp]]:
    """(components, the vertices of the frame in their order)."""
    found, orders, before = [], [], 0
    for mesh in meshes:
        roots = _roots(mesh)
        kept = np.unique(mesh.faces)
        of_vertex = np.unique(roots[kept], return_inverse=True)[1]
        n = int(of_vertex.max()) + 1
        if n > _MOST:
            raise SequenceError(
                f"{where}: {mesh.name} has {n} connected components; split at most {_MOST}, or do not split"
            )
        component = np.zeros(mesh.n_vertices, np.intp)
        component[kept] = of_vertex
        order = kept[np.argsort(of_vertex, kind="stable")]
        counts = np.bincount(of_vertex)
        place = np.zeros(mesh.n_vertices, np.intp)
        place[order] = np.arange(len(order)) - np.repeat(np.cumsum(counts) - counts, counts)
        of_face = component[mesh.faces[:, 0]]
        for k in range(n):
            name = mesh.name if n == 1 else f"{mesh.name}.{k}"
            found.append(SequenceMesh(name, place[mesh.faces[of_face == k]].astype(np.uint32), int(counts[k])))
        orders.append(order + before)
        before += mesh.n_vertices
    return tuple(found), np.concatenate(orders)


def _roots(mesh: SequenceMesh) -> NDArray[np.intp]:
    """(n,): the lowest vertex of each vertex's component."""
    roots = np.arange(mesh.n_vertices)
    faces = mesh.faces.astype(np.intp)
    while True:
        lowest = roots[faces].min(axis=1)
        before = roots.copy()
        np.minimum.at(roots, before[faces].reshape(-1), np.repeat(lowest, 3))
        roots = roots[roots]
        if (roots == before).all():
            return roots
