# SPDX-License-Identifier: Apache-2.0
"""Small scenes of eight points and the smallest distances of their meshes, by the core and by the oracle.

Two results for each pair of meshes: (do they touch, the reported distance) and (do they intersect, the oracle's
distance of the reported features).
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
import oracle

import hpccd_core as hc

from .disturbances import disturb_still
from .generators import GENERATORS

Faces = list[list[list[int]]]

# By kind: the faces of each mesh, and how many points each has. A face that names a vertex twice is an edge; a point in
# no face is tested against those of its own mesh too.
TOPOLOGIES: dict[str, tuple[Faces, list[int]]] = {
    "faces-faces": ([[[0, 1, 2], [1, 2, 3]], [[1, 2, 3]]], [4, 4]),
    "edges-face-point": ([[[0, 1, 1], [2, 3, 3]], [[0, 1, 2]], []], [4, 3, 1]),
}
N_POINTS = 8


def points_of_a_motion(kind: str, name: str) -> Callable[[np.random.Generator, int], np.ndarray]:
    """Both ends of a degenerate query's motion, in any order, as points at rest."""

    def points(rng: np.random.Generator, n: int) -> np.ndarray:
        order = rng.permuted(np.tile(np.arange(N_POINTS), (n, 1)), axis=1)
        return disturb_still(rng, np.take_along_axis(GENERATORS[kind][name](rng, n), order[:, :, None], axis=1))

    return points


def few_places(rng: np.random.Generator, n: int) -> np.ndarray:
    """Small integers: equal distances, coincident points, flat and parallel features."""
    return disturb_still(rng, rng.integers(-2, 3, size=(n, N_POINTS, 3)).astype(float))


GAP_POINTS: dict[str, Callable[[np.random.Generator, int], np.ndarray]] = {
    f"{name}, {kind}": points_of_a_motion(kind, name) for kind, names in GENERATORS.items() for name in names
}
GAP_POINTS[few_places.__name__] = few_places


def true_gaps(kind: str, queries: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """hit and value, (Q, 2 G) of G pairs of meshes; queries: (Q,8,3)."""
    faces, n_vertices = TOPOLOGIES[kind]
    gaps = [oracle.smallest_distances(points, faces, n_vertices=n_vertices, threads=1) for points in queries]
    distance = np.array([[gap.distance for gap in row] for row in gaps])
    intersect = np.array([[gap.intersect for gap in row] for row in gaps])
    touch = intersect.copy()
    for i in np.flatnonzero(((distance == 0) & ~intersect).any(axis=1)):  # also less than half the least number is 0
        meeting = _meeting_meshes(kind, queries[i])
        touch[i] |= [(gap.mesh_a, gap.mesh_b) in meeting for gap in gaps[i]]
    return np.hstack([touch, intersect]), np.hstack([distance, distance])


def _meeting_meshes(kind: str, points: np.ndarray) -> set[tuple[int, int]]:
    faces, n_vertices = TOPOLOGIES[kind]
    mesh_of_vertex = np.repeat(np.arange(len(faces)), n_vertices)
    mesh_of_face = np.repeat(np.arange(len(faces)), [len(of_mesh) for of_mesh in faces])
    near = oracle.proximity(points, 0.0, faces, n_vertices=n_vertices, threads=1)
    first = np.append(mesh_of_vertex[near.vf[:, 0]], mesh_of_vertex[near.ee[:, 0]])
    second = np.append(mesh_of_face[near.vf[:, 1]], mesh_of_vertex[near.ee[:, 2]])
    return {(min(pair), max(pair)) for pair in zip(first.tolist(), second.tolist(), strict=True)}


def core_gaps(kind: str, queries: np.ndarray, accuracy: str, simd: str) -> tuple[np.ndarray, np.ndarray]:
    detector = _detector(kind, accuracy, simd)
    gaps = [detector.distances(points) for points in queries]
    distance = np.array([[gap.distance for gap in row] for row in gaps])
    intersect = np.array([[gap.kind == "edge-face" for gap in row] for row in gaps])
    return np.hstack([distance == 0, intersect]), np.hstack([distance, _distances_of_features(kind, queries, gaps)])


def _distances_of_features(kind: str, queries: np.ndarray, gaps: list[list[hc.Gap]]) -> np.ndarray:
    """By the oracle, (Q, G); of an edge and a face that do not intersect infinite, as where no features are named."""
    faces, n_vertices = TOPOLOGIES[kind]
    starts = np.cumsum([0, *n_vertices])
    corners = [[start + v for v in face] for start, mesh in zip(starts, faces, strict=False) for face in mesh]
    value = np.full((len(queries), len(gaps[0])), np.inf)
    for named, ask in (
        ("vertex-face", oracle.distance_vertex_face),
        ("edge-edge", oracle.distance_edge_edge),
        ("edge-face", lambda points: np.where(oracle.edge_face_intersect(points), 0.0, np.inf)),
    ):
        places = [(i, j) for i, row in enumerate(gaps) for j, gap in enumerate(row) if gap.kind == named]
        if places:
            features = [gaps[i][j].features for i, j in places]
            names = features if named == "edge-edge" else [(*f[:-1], *corners[f[-1]]) for f in features]
            i, j = np.array(places).T
            value[i, j] = ask(queries[i[:, None], np.array(names)])
    return value


@functools.cache
def _detector(kind: str, accuracy: str, simd: str) -> hc.Detector:
    scene = hc.Scene()
    for number, (faces, n) in enumerate(zip(*TOPOLOGIES[kind], strict=True)):
        scene.add_mesh(f"mesh{number}", np.array(faces, dtype=np.uint32).reshape(-1, 3), n_vertices=n)
    return hc.Detector(scene, accuracy=accuracy, simd=simd, backend="cpu", threads=1)
