# SPDX-License-Identifier: Apache-2.0
"""Topologies of small scenes for step queries, with rest positions: sheets, bands, bodies, and malformed meshes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class SmallScene:
    """faces: of each mesh, its own indices; edges: those beside the faces' own, likewise; rest: (V,3), all meshes one
    after the other."""

    faces: list[np.ndarray]
    edges: list[np.ndarray]
    n_vertices: list[int]
    rest: np.ndarray


def grid(rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Faces and positions of a flat sheet in the plane z = 0, edges of length 1."""
    at = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel()
    y, x = np.mgrid[0:rows, 0:columns]
    points = np.stack([x, y, 0 * x], axis=2).reshape(-1, 3) - [(columns - 1) / 2, (rows - 1) / 2, 0]
    return np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)]), points


def octahedron() -> tuple[np.ndarray, np.ndarray]:
    points = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    faces = [[x, y, z] if (x + y + z) % 2 else [x, z, y] for x in (0, 1) for y in (2, 3) for z in (4, 5)]
    return np.array(faces), points


def ring(n: int, turns: float, flat: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """A closed band of 2n triangles: an annulus where flat, else a cylinder; with half a turn a Moebius strip."""
    at = np.arange(n)
    angle, twist = 2 * np.pi * at / n, 2 * np.pi * turns * at / n
    out = np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)
    across = 0.4 * (out if flat else np.cos(twist)[:, None] * [0, 0, 1] + np.sin(twist)[:, None] * out)
    points = np.concatenate([2 * out - across, 2 * out + across])
    low, high, next_low = at, at + n, (at + 1) % n
    next_high = next_low + n
    if turns % 1:  # the end meets the start upside down
        next_low[-1], next_high[-1] = n, 0
    return np.concatenate([np.stack([low, next_low, high], 1), np.stack([high, next_low, next_high], 1)]), points


def careless() -> tuple[np.ndarray, np.ndarray]:
    """Three faces at an edge, a duplicate face, a flipped one, faces that name a vertex twice, discs joined at a
    vertex."""
    faces = [
        [0, 1, 2],
        [0, 1, 3],
        [0, 1, 4],
        [0, 1, 2],
        [1, 0, 3],
        [2, 2, 5],
        [4, 6, 7],
        [4, 7, 8],
        [4, 8, 9],
        [6, 6, 6],
    ]
    points = [
        [0, 0, 0],
        [1, 0, 0],
        [0.5, 1, 0],
        [0.5, -0.5, 1],
        [0.5, -0.5, -1],
        [0.5, 2, 0.5],
        [1.5, -0.5, -1.5],
        [1.5, -1.5, -1.5],
        [0.5, -1.5, -2],
        [-0.5, -1.5, -1.5],
    ]
    return np.array(faces), np.array(points)


def points(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices in no face, on a circle."""
    angle = np.arange(n) * 2 * np.pi / n
    return np.empty((0, 3), int), np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)


def rope(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Edges of length 1 in a straight line: indices in twos."""
    along = np.arange(n) - (n - 1) / 2
    return np.stack([np.arange(n - 1), np.arange(1, n)], 1), np.stack([along, 0 * along, 0 * along], 1)


def scene(*meshes: tuple[np.ndarray, np.ndarray], apart: float = 2.5) -> SmallScene:
    """The meshes one above the other; each has its indices in threes or in twos."""
    rest = [vertices + [0, 0, apart * level] for level, (_, vertices) in enumerate(meshes)]
    by_corners = [
        [indices if indices.shape[1] == corners else np.empty((0, corners), int) for indices, _ in meshes]
        for corners in (3, 2)
    ]
    return SmallScene(*by_corners, [len(v) for v in rest], np.concatenate(rest))


SMALL_SCENES = {
    "sheet": scene(grid(4, 4)),
    "one-leaf": scene(grid(2, 5)),  # 8 triangles: one block of the core's tree
    "long-strip": scene(grid(2, 11)),
    "annulus": scene(ring(8, 0, flat=True)),
    "moebius": scene(ring(9, 0.5)),
    "bodies": scene(octahedron(), octahedron()),
    "sheet-body-points": scene(grid(3, 3), octahedron(), points(3)),
    "sheet-ropes": scene(grid(3, 3), rope(6), rope(3), apart=0.5),
    "careless": scene(careless()),
    "layers": scene(grid(2, 4), grid(3, 2), grid(2, 2), apart=0.25),
}

# With these, chains of motions that stop each other, and single pairs whose points are degenerate queries.
MOTION_SCENES = SMALL_SCENES | {
    "pile": scene(*[grid(2, 2)] * 8, apart=0.125),
    "vertex-face": SmallScene([np.array([[1, 2, 3]])], [np.empty((0, 2), int)], [4], np.eye(4, 3)),
    "edge-edge": SmallScene([np.empty((0, 3), int)], [np.array([[0, 1], [2, 3]])], [4], np.eye(4, 3)),
}
