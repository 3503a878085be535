# SPDX-License-Identifier: Apache-2.0
"""The meshes of a scene with detail, and the detector of their coarse faces."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from .detail_levels import Level, propose
from .detail_options import MeshDetail
from .detail_results import count
from .mesh_layout import Indices, MeshLayout
from .scene import Scene

Doubles = NDArray[np.float64]
Calls = list[tuple[str, tuple[Any, ...]]]

#: Calls of a scene that are those of its coarse scene too; for one mesh, if it is no coarse one. Of a coarse mesh,
#: filters other than `ignore_faces` leave pairs in doubt, which are tested.
_OF_PAIRS = ("ignore_pair", "set_accuracy", "set_separation")
_OF_MESHES = ("set_thickness", "ignore_rings", "ignore_at_rest")


class DetailedMesh:
    """One mesh of the scene, and its levels of detail, made when they are first used.

    Parameters
    ----------
    number : int
    values : tuple
        Of its call of `Scene._repeat`.
    first_vertex : int
        In the scene.
    detail : MeshDetail or None
    """

    def __init__(self, number: int, values: tuple[Any, ...], first_vertex: int, detail: MeshDetail | None) -> None:
        self.number, self.values, self.detail = number, values, detail
        _, self.faces, self.n_vertices, self.self_collision, self.static, edges, *_ = values
        self.slice = slice(first_vertex, first_vertex + self.n_vertices)
        used = np.zeros(self.n_vertices, bool)
        used[self.faces] = True
        self.lone_edges = lone_edges_of(edges, self.faces)
        in_edges = np.zeros(self.n_vertices, bool)
        in_edges[self.lone_edges] = True
        self.kept = np.flatnonzero(~used | in_edges).astype(np.uint32)
        self.thickness: Doubles = np.zeros(1)
        self.rest: Doubles | None = None if detail is None else detail.rest_vertices
        self._levels: dict[float, Level] = {}
        self.at_rest: tuple[NDArray[Any], float, Doubles] | None = None  # of a static mesh: its last deviations

    def level(self, ratio: float, threads: _core.DetailThreads) -> Level:
        if ratio not in self._levels:
            assert self.rest is not None
            proposal = propose(self.faces, self.rest, ratio)
            mesh = _core.CoarseMesh(self.faces, proposal.faces, proposal.survivor, self.rest, threads)
            self._levels[ratio] = Level(mesh, len(self.faces), self.kept)
        return self._levels[ratio]


def lone_edges_of(edges: Indices, faces: Indices) -> Indices:
    """The edges that are in no face."""
    edges = edges[edges[:, 0] != edges[:, 1]]
    if not len(edges):
        return edges
    low, high = edges.min(axis=1), edges.max(axis=1)
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    there = keys(sides.min(axis=1), sides.max(axis=1))
    lone: Indices = edges[~np.isin(keys(low, high), there)]
    return lone


def keys(low: Indices, high: Indices) -> NDArray[np.uint64]:
    both: NDArray[np.uint64] = low.astype(np.uint64) << np.uint64(32) | high
    return both


def check_thickness(mesh: DetailedMesh, thickness: Doubles) -> None:
    """Raises ValueError for what a coarse mesh cannot have."""
    if mesh.detail is None or not thickness.any():
        return
    if len(thickness) not in (1, len(mesh.faces)):
        raise ValueError(
            f"thickness: expected one number or {len(mesh.faces)}, one for each face, got {len(thickness)}"
        )
    if len(mesh.kept):
        raise ValueError(
            f"detail: {mesh.values[0]!r} has a thickness, and edges or points beside its faces; add those as another "
            "mesh"
        )


class CoarseScene:
    """A detector of coarse meshes at one choice of levels, and how its numbers translate.

    Planes are among its meshes, so that all numbers agree, and are not tested.

    Parameters
    ----------
    calls : list
        Of the scene, as in `Scene._calls`.
    layout : MeshLayout
        Of the scene.
    meshes : list of DetailedMesh
    levels : tuple of Level or None
        By mesh; None: the mesh as it is.
    within : list of DetailedMesh
        Coarse meshes that are tested against themselves.
    refine : bool
        Whether another detector tests those.
    options : _core.Options
    threads : _core.DetailThreads
    """

    def __init__(
        self,
        calls: Calls,
        layout: MeshLayout,
        meshes: list[DetailedMesh],
        levels: tuple[Level | None, ...],
        within: list[DetailedMesh],
        refine: bool,
        options: _core.Options,
        threads: _core.DetailThreads,
    ) -> None:
        scene = Scene()
        vertices, faces = [np.empty(0, np.uint32)], [np.empty((0, 3), np.uint32)]
        begin = [0]
        self.levels = levels
        coarse_numbers = {mesh.number for mesh in meshes if mesh.detail}
        each = iter(zip(meshes, levels, strict=True))
        for name, values in calls:
            if name == "add_mesh":
                mesh, level = next(each)
                if level is None:
                    of_mesh, coarse = np.arange(mesh.n_vertices, dtype=np.uint32), mesh.faces
                    scene._repeat(name, values)
                else:
                    of_mesh, coarse = level.vertices, level.faces
                    local = (np.searchsorted(of_mesh, given).astype(np.uint32) for given in (coarse, mesh.lone_edges))
                    compact, edges = local
                    scene._repeat(name, (values[0], compact, len(of_mesh), *values[3:5], edges, *values[6:]))
                vertices.append(of_mesh + np.uint32(mesh.slice.start))
                faces.append(coarse + np.uint32(mesh.slice.start))
                begin.append(begin[-1] + len(coarse))
            elif name == "add_plane":
                scene._repeat(name, values)
                begin.append(begin[-1])
            elif name in _OF_PAIRS or name in _OF_MESHES and values[0] not in coarse_numbers:
                scene._repeat(name, values)
        for plane in layout.planes.tolist():
            for other in range(len(layout.mesh_names)):
                scene._repeat("ignore_pair", (plane, other))
        self.vertices, self.faces = np.concatenate(vertices), np.concatenate(faces)
        self.layout = dataclasses.replace(layout, face_offsets=np.array(begin, np.int64))
        self.face_slices = [slice(a, b) for a, b in zip(begin[:-1], begin[1:], strict=True)]
        self._ignore_neighbours(scene, meshes, within, refine, threads)
        self._ignore_faces(scene, calls, meshes)
        self.core = _core.Detector(scene._core, options)
        self.end: tuple[object, NDArray[Any]] | None = None
        self._features = _core.CoarseFeatures(self.faces, int(layout.vertex_offsets[-1]))

    def _ignore_neighbours(
        self,
        scene: Scene,
        meshes: list[DetailedMesh],
        within: list[DetailedMesh],
        refine: bool,
        threads: _core.DetailThreads,
    ) -> None:
        """Ignore what is outside the promise."""
        for mesh, level in zip(meshes, self.levels, strict=True):
            if refine and mesh in within:
                scene._repeat("ignore_pair", (mesh.number, mesh.number))
            elif level is not None and mesh in within:
                pairs = level.mesh.neighbour_pairs(mesh.lone_edges, mesh.n_vertices, threads)
                first_vertex = np.searchsorted(self.vertices, mesh.slice.start)
                first_face = self.face_slices[mesh.number].start
                for rows, columns in zip(pairs, (1, 4, 2), strict=True):
                    rows[:, :columns] = np.searchsorted(level.vertices, rows[:, :columns]) + first_vertex
                    rows[:, columns:] += np.uint32(first_face)
                if any(map(len, pairs)):
                    scene._repeat("ignore_features", pairs)

    def _ignore_faces(self, scene: Scene, calls: Calls, meshes: list[DetailedMesh]) -> None:
        """Ignore coarse faces whose faces are all ignored against a mesh."""
        ignored: dict[tuple[int, int], list[Indices]] = {}
        for name, values in calls:
            if name == "ignore_faces":
                ignored.setdefault((values[0], values[2]), []).append(values[1])
        levels = {mesh.number: level for mesh, level in zip(meshes, self.levels, strict=True)}
        for (number, other), faces in ignored.items():
            listed, level = np.unique(np.concatenate(faces)), levels[number]
            if level is not None:  # those with no face that is not listed
                others = level.held[~np.isin(level.held[:, 1], listed), 0]
                listed = np.setdiff1d(np.arange(len(level.faces), dtype=np.uint32), others)
            scene._repeat("ignore_faces", (number, listed.astype(np.uint32), other))

    def bounds(self, found: dict[str, Any], deviations: Doubles) -> Doubles:
        """Of each row of a result, in the numbers of the scene: the sum of the deviations of both sides."""
        bounds = np.zeros(count(found))
        of_pairs = self._features.bounds(found["vf"], found["ee"], deviations)
        bounds[: len(of_pairs)] = of_pairs
        return bounds
