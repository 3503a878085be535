# SPDX-License-Identifier: Apache-2.0
"""Inside, separating translations and depth, by exact tests of all pairs.

A mesh is a pair (vertices, faces): (V,3) finite numbers, (F,3) integers. threads: 0 = all cores.
"""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Sequence

import _oracle
import numpy as np
from numpy.typing import ArrayLike

Mesh = tuple[np.ndarray, np.ndarray]
POINTS_AT_ONCE = 20_000  # each takes some 300 bytes


def closed(faces: ArrayLike) -> bool:
    """Whether each edge is in exactly two faces, once in each direction."""
    return _closed(np.asarray(faces, np.int64).tobytes())


@functools.cache
def _closed(faces: bytes) -> bool:
    ways = Counter((f[i], f[i - 2]) for f in np.frombuffer(faces, np.int64).reshape(-1, 3).tolist() for i in range(3))
    return all(n == 1 and ways[b, a] == 1 for (a, b), n in dict(ways).items())


def winding_numbers(mesh: Mesh, points: ArrayLike, threads: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Winding numbers (K,) int32 of points (K,3) in a closed mesh, and whether they are on its surface (0 there).

    By rays in a random direction, in which none of them meets a border of a face.
    """
    points = np.asarray(points, np.float64).reshape(-1, 3)
    parts = [
        _oracle.winding_numbers(*mesh, points[i : i + POINTS_AT_ONCE], threads)
        for i in range(0, max(1, len(points)), POINTS_AT_ONCE)
    ]
    numbers, on_surface = (np.concatenate(part) for part in zip(*parts, strict=True))
    return numbers, on_surface.astype(bool)


def contained(meshes: Sequence[Mesh], threads: int = 0) -> np.ndarray:
    """(N,N) bool: whether a vertex of mesh i is inside the closed mesh j. Meshes that touch are for the caller to tell.

    Where two meshes do not touch, a component has all of its vertices inside the other one or none.
    """
    inside = np.zeros((len(meshes),) * 2, bool)
    for j, mesh in enumerate(meshes):
        if not len(mesh[1]) or not closed(mesh[1]):
            continue
        others = [i for i in range(len(meshes)) if i != j]
        numbers, _ = winding_numbers(mesh, np.concatenate([meshes[i][0] for i in others]), threads)
        ends = np.cumsum([len(meshes[i][0]) for i in others])
        inside[others, j] = [part.any() for part in np.split(numbers != 0, ends[:-1])]
    return inside


def separating_translations(pairs: Sequence[tuple[Mesh, Mesh]], directions: ArrayLike, threads: int = 0) -> np.ndarray:
    """For pairs (a, b) the infimum of the s >= 0 for which a, moved by s along the direction, is free of b.

    Free: no common point, and no vertex of either inside the other where that is closed. Rounded to the nearest double.
    """
    return _oracle.separating_translations(_pairs(pairs), np.asarray(directions, np.float64).reshape(-1, 3), threads)


def convex_depths(pairs: Sequence[tuple[Mesh, Mesh]], threads: int = 0) -> np.ndarray:
    """For pairs of convex meshes the length of the shortest translation that separates them, 0 where they are apart.

    By all directions that are normal to a face of either, or to an edge of each. Rounded to the nearest double.
    """
    return _oracle.convex_depths(_pairs(pairs), threads)


def edge_face_points(points: ArrayLike, threads: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where closed edges enter closed faces; points: (Q,5,3), two ends, three corners.

    Parameters along the edges (Q,), the least of all common points; barycentric coordinates (Q,3); points (Q,3).
    Rounded to the nearest double. NaN where there is no common point, and as barycentric coordinates of a face without
    area.
    """
    found = _oracle.edge_face_points(np.asarray(points, np.float64), threads)
    return found[:, 0], found[:, 1:4], found[:, 4:]


def _pairs(pairs: Sequence[tuple[Mesh, Mesh]]) -> list:
    return [tuple(_oracle.OneMesh(*mesh, closed(mesh[1])) for mesh in pair) for pair in pairs]
