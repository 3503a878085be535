# SPDX-License-Identifier: Apache-2.0
"""Cloth draped on a ball that then spins (after Kim et al. 2009, Fig. 1)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from hpccd_core.shapes import grid, icosphere
from hpccd_ros.scenes import cache, cloth
from hpccd_ros.scenes.exactmath import axis_angle, rotate
from hpccd_ros.scenes.scene import Frame, Mesh, Scene


def make(
    name: str,
    title: str,
    setup: cloth.Setup,
    cloth_triangles: int,
    ball_triangles: int,
    size: float,
    frames: int,
    seed: int,
    show_progress: bool,
) -> Scene:
    """One simulated motion, meshed with about (cloth_triangles + ball_triangles) * size triangles."""
    cells = max(2, round((cloth_triangles * size / 2) ** 0.5))

    @lru_cache(maxsize=1)
    def grids():
        return cache.cached(
            name, (setup, frames, seed), [cloth], lambda: {"grids": cloth.simulate(setup, frames, seed, show_progress)}
        )["grids"]

    ball, ball_faces = icosphere(max(2, round((ball_triangles * size / 20) ** 0.5)))
    ball = ball * setup.ball_mesh_radius
    _, cloth_faces = grid(cells, cells)
    axis = np.array([0.0, 0.0, 1.0])

    def frame(index: int) -> Frame:
        time = index * setup.frame_period
        turned = rotate(axis_angle(axis, setup.ball_angle(time)), ball)
        return Frame([cloth.refine(grids()[index], cells), turned], index, time)

    meshes = (
        Mesh("cloth", cloth_faces, (cells + 1) * (cells + 1)),
        Mesh("ball", ball_faces, len(ball), self_collision=False),
    )
    return Scene(name, title, meshes, frames, setup.frame_period, frame)
