# SPDX-License-Identifier: Apache-2.0
"""Meshes that subjects generate: nets, small folded sheets for many worlds, and ropes."""

from __future__ import annotations

import numpy as np

import hpccd_core as hc
from hpccd_ros.bench.sources import Step
from hpccd_ros.scenes.scene import Mesh

COLUMNS, ROWS = 46, 31  # of a garment
DIFFERENT = 256  # worlds with a motion of their own; the motions repeat in more of them
FOLD = 37


def sheet(columns: int, rows: int) -> np.ndarray:
    """Faces (2 (columns - 1) (rows - 1), 3) of a regular net of vertices, row by row."""
    i = np.arange(columns * rows, dtype=np.uint32).reshape(rows, columns)
    a, b, c, d = i[:-1, :-1].ravel(), i[1:, :-1].ravel(), i[:-1, 1:].ravel(), i[1:, 1:].ravel()
    return np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])


def flat(columns: int, rows: int) -> np.ndarray:
    """Its vertices (columns rows, 3), one apart."""
    x, y = np.meshgrid(np.arange(columns), np.arange(rows))
    return np.stack([x, y, np.zeros((rows, columns))], 2).reshape(-1, 3)


def two_nets(n: int) -> Step:
    """Two waved sheets of n x n vertices, the second 0.3, 0.4 beside and 0.2 above the first, sinking by 0.3 while both
    are shaken a little: 4 (n - 1)^2 triangles. Many contacts, and many of them degenerate."""
    rng = np.random.default_rng(0)
    start = flat(n, n).astype(np.float32)
    start[:, 2] = 3 * np.sin(start[:, 0] / 20) * np.cos(start[:, 1] / 17)
    end = start.copy()
    end[:, 2] += rng.normal(0, 0.05, len(start)).astype(np.float32)
    faces = sheet(n, n)
    above, after = np.float32([0.3, 0.4, 0.2]), np.float32([0.3, 0.4, -0.1])
    return Step(
        (Mesh("a", faces, n * n), Mesh("b", faces, n * n)),
        0,
        np.concatenate([start, start + above]),
        np.concatenate([end, end + after]),
    )


def sphere(rings: int, phase: float) -> tuple[np.ndarray, np.ndarray]:
    """Faces and vertices of a closed sphere of radius 1 that waves with the phase: rings of 2 rings vertices."""
    width = 2 * rings
    polar, around = np.meshgrid(
        np.pi * np.arange(1, rings + 1) / (rings + 1), 2 * np.pi * np.arange(width) / width, indexing="ij"
    )
    radius = 1 + 0.03 * np.sin(5 * around + phase) * np.sin(4 * polar + 0.5 * phase)
    xyz = np.stack(
        [radius * np.sin(polar) * np.cos(around), radius * np.sin(polar) * np.sin(around), -radius * np.cos(polar)], -1
    )
    south, north, i = rings * width, rings * width + 1, np.arange(width)
    low = (np.arange(rings - 1)[:, None] * width + i).ravel()
    after = (np.arange(rings - 1)[:, None] * width + (i + 1) % width).ravel()
    last = (rings - 1) * width
    faces = [
        np.stack([np.full(width, south), (i + 1) % width, i], -1),
        np.stack([np.full(width, north), last + i, last + (i + 1) % width], -1),
        np.stack([low, after, after + width], -1),
        np.stack([low, after + width, low + width], -1),
    ]
    poles = [[0, 0, -1], [0, 0, 1]]
    return np.concatenate(faces).astype(np.uint32), np.concatenate([xyz.reshape(-1, 3), poles])


def _way_between(gap: float) -> np.ndarray:
    way = np.array([0.8, 0.5, 0.33])
    return way * ((2 + gap) / np.linalg.norm(way))


def two_spheres(rings: int, gap: float) -> Step:
    """Two deforming spheres, each tested against the other only; about `gap` apart, below 0 they intersect."""
    way = _way_between(gap)
    faces = sphere(rings, 0)[0]
    ends = [
        np.concatenate([sphere(rings, 0.05 * k)[1], sphere(rings, 1 + 0.04 * k)[1] + way]).astype(np.float32)
        for k in range(2)
    ]
    meshes = tuple(
        Mesh(name, faces, 2 * rings * rings + 2, self_collision=False) for name in ("sphere", "other sphere")
    )
    return Step(meshes, 0, *ends)


def rigid_spheres(rings: int) -> tuple[hc.Scene, int]:
    """Two such spheres that take poses, and their triangles together."""
    scene = hc.Scene()
    for phase, name in enumerate(("sphere", "other sphere")):
        faces, xyz = sphere(rings, phase)
        scene.add_mesh(name, faces, shape=xyz, self_collision=False)
    return scene, 2 * len(faces)


def poses_of_spheres(gap: float, k: int) -> np.ndarray:
    """Their poses (2, 7), about `gap` apart, in call k: each turns by a fraction of a degree from call to call."""
    a, b = 0.003 * k, 0.2 - 0.002 * k
    here = [0, 0, 0, np.sin(a), 0, 0, np.cos(a)]
    there = [*_way_between(gap + 1e-4 * (k % 40)), 0, 0.6 * np.sin(b), 0.8 * np.sin(b), np.cos(b)]
    return np.array([here, there])


def garment() -> np.ndarray:
    """Faces of a garment of 2,700 triangles."""
    return sheet(COLUMNS, ROWS)


def motions(worlds: int) -> tuple[np.ndarray, np.ndarray]:
    """Start and end (worlds, V, 3) float32 of a garment: folded once, waved and rough, then pressed together at one
    place and moved as a whole, differently in each world."""
    rng = np.random.default_rng(0)
    half = (COLUMNS - 1) / 2
    folded = flat(COLUMNS, ROWS)
    upper = folded[:, 0] > half
    folded[upper, 0] = 2 * half - folded[upper, 0]
    start, end = np.empty((2, min(worlds, DIFFERENT), *folded.shape), np.float32)
    for k in range(len(start)):
        p, phase = folded.copy(), rng.random(3) * 6
        p[:, 2] = 0.8 * np.sin(p[:, 1] / 4 + phase[0]) + 0.5 * np.cos(p[:, 0] / 5 + phase[1])
        p[upper, 2] += 0.6 + 0.05 * np.sin(3 * p[upper, 1] + phase[2])
        p += rng.normal(0, 0.03, p.shape)
        q = p + rng.normal(0, 0.03, p.shape)
        x, y = rng.uniform(6, half - 4), rng.uniform(5, ROWS - 6)
        q[upper, 2] -= np.exp(-((p[:, 0] - x) ** 2 + (p[:, 1] - y) ** 2) / 12.0)[upper]
        start[k], end[k] = p, q + rng.normal(0, 0.3, 3)
    again = np.arange(worlds) % len(start)
    return start[again], end[again]


def folded_sheet() -> tuple[np.ndarray, np.ndarray]:
    """Faces and vertices (V, 3) float32 of a sheet of 2,592 triangles, folded once, its halves 0.3 apart."""
    p = flat(FOLD, FOLD).astype(np.float32)
    upper, line = p[:, 0] > FOLD // 2, p[:, 1].copy()
    p[upper, 0] = FOLD - 1 - p[upper, 0]
    p[upper, 2] = 0.3 + 0.05 * np.sin(line[upper])
    p[:, 2] += 0.2 * np.sin(line / 3)
    return sheet(FOLD, FOLD), p


def tangle(ropes: int, segments: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges (ropes segments, 2), and start and end (V, 3) float32: smooth random curves through a box in which there is
    a segment for each cube of its length."""
    rng = np.random.default_rng(0)
    side = (1.0 * ropes * segments) ** (1 / 3)
    turns = rng.normal(0, 0.35, (ropes, segments + 1, 3)).cumsum(axis=1) + rng.normal(0, 2, (ropes, 1, 3))
    ways = turns / np.linalg.norm(turns, axis=2, keepdims=True)
    points = rng.uniform(0, side, (ropes, 1, 3)) + ways.cumsum(axis=1)
    points = side - np.abs(points % (2 * side) - side)  # reflected at the walls
    start = points.reshape(-1, 3).astype(np.float32)
    sway = rng.normal(0, 0.2 / np.sqrt(3), (ropes, 1, 3)) + rng.normal(0, 0.02, points.shape)
    first = (np.arange(ropes)[:, None] * (segments + 1) + np.arange(segments)).reshape(-1, 1)
    return np.hstack([first, first + 1]), start, (points + sway).reshape(-1, 3).astype(np.float32)
