# SPDX-License-Identifier: Apache-2.0
"""An arm takes a cloth between two fingers and drags it across a table."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from hpccd_core.shapes import grid
from hpccd_ros.robots import arm
from hpccd_ros.scenes import cache, cloth, dragged_cloth, gripper, shapes
from hpccd_ros.scenes.robot import SceneRobot
from hpccd_ros.scenes.scene import Frame, Mesh, Scene

BOARD = 0.03  # thickness of the table's top
TABLE_CELL = 0.05

# Modules that the numbers depend on.
SOURCES = [arm, cloth, dragged_cloth, gripper]


def make(
    name: str, title: str, cloth_triangles: int, size: float, frames: int, seed: int, show_progress: bool
) -> Scene:
    """One simulated motion. The cloth is meshed with about cloth_triangles * size triangles; table and arm are as they
    are at any size."""
    setup = dragged_cloth.Setup()
    cells = max(2, round((cloth_triangles * size / 2) ** 0.5))
    robot = SceneRobot(arm.NAME, arm.description(), arm.joint_positions)

    @lru_cache(maxsize=1)
    def grids():
        return cache.cached(
            name, (setup, seed), SOURCES, lambda: {"grids": dragged_cloth.simulate(setup, seed, show_progress)}
        )["grids"]

    table, table_faces = _table()
    _, cloth_faces = grid(cells, cells)

    def frame(index: int) -> Frame:
        part = index / (frames - 1)
        grid = dragged_cloth.between(grids(), index * setup.samples / (frames - 1))
        time = arm.DURATION * part
        return Frame([table, cloth.refine(grid, cells), *robot.vertices(time)], index, time)

    meshes = (
        Mesh("table", table_faces, len(table), static=True, self_collision=False),
        Mesh("cloth", cloth_faces, (cells + 1) * (cells + 1)),
        *robot.meshes,
    )
    period = arm.DURATION / (frames - 1)
    return Scene(name, title, meshes, frames, period, frame, robots=(robot,), ignored_pairs=robot.robot.ignored_pairs)


def _table():
    x0, x1, y0, y1 = arm.TABLE
    middle, half = np.array([x0 + x1, y0 + y1, 0.0]) / 2, np.array([(x1 - x0) / 2, (y1 - y0) / 2, BOARD])
    vertices, faces = shapes.board(round((x1 - x0) / TABLE_CELL), round((y1 - y0) / TABLE_CELL))
    return middle + half * vertices, faces
