# SPDX-License-Identifier: Apache-2.0
"""Two regular nets that meet nearly edge on edge: many contacts, and many of them degenerate."""

from __future__ import annotations

import numpy as np

from hpccd_ros.bench.sources import Step
from hpccd_ros.scenes.scene import Mesh


def sheet(columns: int, rows: int) -> np.ndarray:
    """Faces (2 (columns - 1) (rows - 1), 3) of a regular net of vertices, row by row."""
    i = np.arange(columns * rows, dtype=np.uint32).reshape(rows, columns)
    a, b, c, d = i[:-1, :-1].ravel(), i[1:, :-1].ravel(), i[:-1, 1:].ravel(), i[1:, 1:].ravel()
    return np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])


def flat(columns: int, rows: int) -> np.ndarray:
    """Its vertices (columns rows, 3), one apart."""
    x, y = np.meshgrid(np.arange(columns), np.arange(rows))
    return np.stack([x, y, np.zeros((rows, columns))], 2).reshape(-1, 3)


def step(n: int) -> Step:
    """Two waved sheets of n x n vertices, the second 0.3, 0.4 beside and 0.2 above the first, sinking by 0.3 while both
    are shaken a little: 4 (n - 1)^2 triangles."""
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
