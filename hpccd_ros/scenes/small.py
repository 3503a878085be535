# SPDX-License-Identifier: Apache-2.0
"""Scenes small enough to check by hand."""

from __future__ import annotations

import numpy as np

from hpccd_core.shapes import grid
from hpccd_ros.scenes.exactmath import PI, sincos
from hpccd_ros.scenes.scene import Frame, Mesh, Scene

FRAME_PERIOD = 1 / 30


def two_triangles(name: str, title: str, frames: int) -> Scene:
    """A triangle falls at constant speed until its corner (0, 0), 0.25 above another one, is 0.28 below it.

    There is exactly one vertex-face contact in the whole motion, when 25/53 of it are done; then the two edges
    beside the corner never touch an edge of the larger triangle, whose inside they cross.
    """
    lower = np.array([(-1, -1, 0), (2, -1, 0), (-1, 2, 0)], dtype=np.float32)
    upper = np.array([(0, 0, 0), (0.5, 0, 0.5), (0, 0.5, 0.5)])
    faces = np.array([[0, 1, 2]], dtype=np.uint32)

    def frame(index: int) -> Frame:
        height = 0.25 - 0.53 * index / (frames - 1)
        return Frame([lower, upper + (0, 0, height)], index, index * FRAME_PERIOD)

    meshes = (Mesh("lower", faces, 3), Mesh("upper", faces, 3))
    return Scene(name, title, meshes, frames, FRAME_PERIOD, frame)


def folding_strip(name: str, title: str, size: float, frames: int) -> Scene:
    """A strip of 3 x 0.6 is folded twice like a letter, each fold past half a turn: its panels pass through
    one another. The folds are a little sharper at one side, so that panels never come to lie in one plane.
    """
    along, across = max(12, round(90 * size**0.5)), max(2, round(18 * size**0.5))
    flat, faces = grid(along, across)
    # 0 to 1 over each fold, as a function of the length along the strip (in the middle of each cell).
    middle = (np.arange(along) + 0.5) * (3.0 / along)
    ramps = [np.clip((middle - fold) / 0.25 + 0.5, 0.0, 1.0) for fold in (0.95, 2.05)]
    bend = sum(ramp * ramp * (3.0 - 2.0 * ramp) for ramp in ramps)

    def frame(index: int) -> Frame:
        y = 0.3 * flat[:: along + 1, 1]
        angle = (1.15 * PI * index / (frames - 1)) * (1.0 + 0.1 * y[:, None]) * bend[None, :]
        s, c = sincos(angle)
        at = np.zeros((across + 1, along + 1, 3))
        at[:, 1:, 0] = np.cumsum(c, axis=1) * (3.0 / along)
        at[:, 1:, 2] = np.cumsum(s, axis=1) * (3.0 / along)
        at[:, :, 1] = y[:, None]
        return Frame([at.reshape(-1, 3)], index, index * FRAME_PERIOD)

    return Scene(name, title, (Mesh("strip", faces, len(flat)),), frames, FRAME_PERIOD, frame)
