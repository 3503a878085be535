# SPDX-License-Identifier: Apache-2.0
"""What a detector with detail tests on all vertices: contacts within refined meshes, and planes."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from .detail_meshes import Calls, DetailedMesh, Doubles
from .detail_results import copied_rows, count, renumbered, translated
from .mesh_layout import MeshLayout
from .scene import Scene

Ends = tuple[NDArray[Any], ...]


class FullMeshes:
    """A detector of contacts within meshes, on their own faces.

    Parameters
    ----------
    calls, layout, options
        As of `CoarseScene`.
    meshes : list of DetailedMesh
        Those.
    features : (bool, bool)
        Kinds of features that are tested.
    """

    def __init__(
        self,
        calls: Calls,
        layout: MeshLayout,
        meshes: list[DetailedMesh],
        options: _core.Options,
        features: tuple[bool, bool],
    ) -> None:
        self.numbers = {mesh.number: k for k, mesh in enumerate(meshes)}
        scene = Scene()
        number = -1
        for name, values in calls:
            if name in ("add_mesh", "add_plane"):
                number += 1
                if number in self.numbers:
                    scene._repeat(name, values)
            elif name in ("set_thickness", "ignore_rings", "ignore_at_rest"):
                if values[0] in self.numbers:
                    scene._repeat(name, (self.numbers[values[0]], *values[1:]))
            elif name == "ignore_faces":
                if values[0] == values[2] and values[0] in self.numbers:
                    scene._repeat(name, (self.numbers[values[0]], values[1], self.numbers[values[0]]))
            elif name in ("set_accuracy", "set_separation", "set_features"):
                if values[0] == values[1] and values[0] in self.numbers:
                    scene._repeat(name, (self.numbers[values[0]],) * 2 + values[2:])
        for pair in itertools.combinations(range(len(self.numbers)), 2):
            scene._repeat("ignore_pair", pair)
        self._slices = [mesh.slice for mesh in meshes]
        self.vertices = np.concatenate([np.arange(s.start, s.stop, dtype=np.uint32) for s in self._slices])
        self.faces = np.concatenate([mesh.faces + np.uint32(mesh.slice.start) for mesh in meshes])
        self._translate(scene, calls, layout, meshes)
        tested, options.features = options.features, _core.TestedFeatures(*features)
        self.core = _core.Detector(scene._core, options)
        options.features = tested

    def _translate(self, scene: Scene, calls: Calls, layout: MeshLayout, meshes: list[DetailedMesh]) -> None:
        """Repeat the ignored pairs of features whose both sides are in these meshes."""
        new_vertex = np.full(int(layout.vertex_offsets[-1]), -1, np.int64)
        new_vertex[self.vertices] = np.arange(len(self.vertices))
        new_face = np.full(int(layout.face_offsets[-1]), -1, np.int64)
        faces = [np.arange(*layout.face_offsets[mesh.number : mesh.number + 2]) for mesh in meshes]
        new_face[np.concatenate(faces)] = np.arange(len(self.faces))
        for name, rows in calls:
            if name == "ignore_features":
                new = []
                for pairs, columns in zip(rows, (1, 4, 2), strict=True):
                    both = np.concatenate([new_vertex[pairs[:, :columns]], new_face[pairs[:, columns:]]], axis=1)
                    new.append(both[(both >= 0).all(axis=1)].astype(np.uint32))
                scene._repeat(name, tuple(new))

    def _of_meshes(self, vertices: NDArray[Any]) -> NDArray[Any]:
        return np.concatenate([vertices[s] for s in self._slices])

    def detect(self, ends: Ends, first_face: int) -> dict[str, Any]:
        found = renumbered(copied_rows(self.core.detect(*map(self._of_meshes, ends))), self.vertices, first_face)
        found["bounds"] = np.zeros(count(found))
        return found

    def collision_free_step(self, ends: Ends) -> float:
        return float(self.core.collision_free_steps(*map(self._of_meshes, ends))[0])

    def distances(self, vertices: NDArray[Any], first_face: int) -> list[tuple[Any, ...]]:
        numbers = list(self.numbers)
        return [
            (numbers[a], numbers[b], *translated((a, b, *others), self.vertices, first_face)[2:])
            for a, b, *others in self.core.distances(self._of_meshes(vertices))
        ]


class PlanesOfAll:
    """A detector of vertices and planes. Coarse meshes have fewer vertices, so it has those of the scene: the meshes
    without their faces, unless some of these are ignored against a plane.

    Parameters
    ----------
    calls, layout, options
        As of `CoarseScene`.
    meshes : list of DetailedMesh
        All of the scene.
    """

    def __init__(self, calls: Calls, layout: MeshLayout, meshes: list[DetailedMesh], options: _core.Options) -> None:
        self._meshes, planes = {mesh.number: mesh for mesh in meshes}, set(layout.planes.tolist())
        self._with_faces = {values[0] for name, values in calls if name == "ignore_faces" and values[2] in planes}
        scene, added = Scene(), iter(meshes)
        for name, values in calls:
            if name == "add_mesh":
                mesh = next(added)
                faces = mesh.faces if mesh.number in self._with_faces else mesh.faces[:0]
                none = np.empty((0, 2), np.uint32)
                scene._repeat(name, (values[0], faces, mesh.n_vertices, False, mesh.static, none))
            elif name == "set_thickness":
                scene._repeat(name, (values[0], self._of_vertices(*values)))
            elif name in ("add_plane", "set_accuracy", "set_separation", "ignore_pair"):
                scene._repeat(name, values)
            elif name == "ignore_faces" and values[2] in planes:
                scene._repeat(name, values)
        for pair in itertools.combinations([mesh.number for mesh in meshes], 2):
            scene._repeat("ignore_pair", pair)
        self.core = _core.Detector(scene._core, options)

    def _of_vertices(self, number: int, thickness: Doubles) -> Doubles:
        """A thickness by face or by edge, as one by vertex if the mesh has no faces here."""
        mesh = self._meshes[number]
        if len(thickness) == 1 or number in self._with_faces:
            return thickness
        elements = mesh.faces if len(mesh.faces) else mesh.values[5]
        if not len(elements):
            return thickness
        of_vertices: Doubles = np.zeros(mesh.n_vertices)
        np.maximum.at(of_vertices, elements, thickness[:, None])
        return of_vertices

    def set_thickness(self, number: int, thickness: Doubles) -> None:
        self.core.set_thickness(number, self._of_vertices(number, thickness))

    def detect(self, ends: Ends) -> dict[str, Any]:
        found = copied_rows(self.core.detect(*ends))
        found["bounds"] = np.zeros(count(found))
        return found

    def distances(self, vertices: NDArray[Any]) -> list[tuple[Any, ...]]:
        return list(self.core.distances(vertices))
