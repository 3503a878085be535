# SPDX-License-Identifier: Apache-2.0
"""The scene of the meshes of a frame."""

import itertools

import numpy as np
from numpy.typing import NDArray

from ..mesh_files.welding import weld
from ..scene import Scene
from ..sequences import Frame, SequenceError, SequenceMesh


class FrameScene:
    """The scene of one topology. Vertices in no face are left out: no surface passes through them.

    Parameters
    ----------
    meshes : tuple of SequenceMesh
        As :attr:`Frame.meshes`.
    separation : float
        Separation of two different meshes, in the unit of the positions.
    welded : Frame, optional
        A frame with these meshes; vertices at equal positions in it become one.

    Attributes
    ----------
    scene : Scene
        For contacts and intersections: all pairs, and each mesh with itself.
    apart : Scene
        For distances: pairs of different meshes; of a single mesh, with itself.
    faces : list of (F, 3) uint32
        Faces of each mesh, as numbers of its vertices in the scene.
    counts : list of int
        Vertices of each mesh in the scene.
    """

    def __init__(self, meshes: tuple[SequenceMesh, ...], separation: float, welded: Frame | None = None) -> None:
        self.meshes = meshes
        self.scene, self.apart = Scene(), Scene()
        self.faces: list[NDArray[np.uint32]] = []
        self.counts: list[int] = []
        first, kept = 0, []
        joined: list[NDArray[np.intp]] = []
        for mesh in meshes:
            used, faces = _compact(mesh.faces)
            if welded is not None:
                _, faces, index = weld(welded.vertices[first + used], faces)
                if not len(faces):
                    raise SequenceError(f"{welded.name}: {mesh.name} has no face with an area; check without --weld")
                chosen = used[np.unique(index, return_index=True)[1]]
                joined.append(first + np.stack([chosen[index], used]))
                used, faces = _compact(faces)
                used = chosen[used]
            self.faces.append(faces)
            self.counts.append(len(used))
            for scene in (self.scene, self.apart):
                scene.add_mesh(mesh.name, faces, n_vertices=len(used))
            if len(meshes) > 1:
                self.apart.ignore_pair(mesh.name, mesh.name)
            kept.append(first + used)
            first += mesh.n_vertices
        if separation:
            for a, b in itertools.combinations([mesh.name for mesh in meshes], 2):
                self.scene.set_separation(a, b, separation)
        self.kept = np.concatenate(kept)
        self._joined = np.concatenate(joined, axis=1) if joined else None

    def positions(self, frame: Frame) -> NDArray[np.float64]:
        """The vertices of the scene in a frame with the same meshes.

        Raises
        ------
        SequenceError
            Vertices that were joined are not at the same position.
        """
        x = frame.vertices
        if self._joined is not None:
            a, b = self._joined
            apart = np.flatnonzero((x[a] != x[b]).any(axis=1))
            if len(apart):
                raise SequenceError(
                    f"{frame.name}: vertices {a[apart[0]]} and {b[apart[0]]}, at one position in the first frame, are "
                    "apart here; check without --weld"
                )
        return x[self.kept]


def _compact(faces: NDArray[np.uint32]) -> tuple[NDArray[np.intp], NDArray[np.uint32]]:
    """(the vertices that faces use, the faces as numbers of these)."""
    used, numbers = np.unique(faces, return_inverse=True)
    return used.astype(np.intp), numbers.reshape(-1, 3).astype(np.uint32)
