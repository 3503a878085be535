# SPDX-License-Identifier: Apache-2.0
"""Limits of the coordinates that the core accepts. No ROS."""

import numpy as np

from hpccd_core.arguments import LARGEST_COORDINATE
from hpccd_ros.frames.drops import Reason

# Limit for meshes that move by poses. Between two poses the distance of a point from the origin is at most twice that
# of the farther end (rigid/screw.py: the arc bulges by half its chord at most); bounds of motion are no longer, and add
# up with those of another mesh and a separation. All of them must be within the core's limits, or a step fails halfway.
LARGEST_OF_POSES = LARGEST_COORDINATE / 1000


def unusable_coordinates(vertices: np.ndarray, by_poses: bool = False) -> tuple[Reason, str] | None:
    """Why the core cannot use these positions, (n,3), or None. by_poses: including the motion to and from them."""
    largest = LARGEST_OF_POSES if by_poses else LARGEST_COORDINATE
    # Two reductions, as they need no array of their own; NaN passes through both and compares false.
    if not len(vertices) or (-largest <= float(vertices.min()) and float(vertices.max()) <= largest):
        return None
    if not (finite := np.isfinite(vertices)).all():
        return Reason.NOT_FINITE, f"{_first(vertices, ~finite)}; coordinates must be finite"
    of_mesh = " of a mesh that moves by poses" if by_poses else ""
    limits = f"coordinates{of_mesh} must lie in [-{largest:g}, {largest:g}]"
    return Reason.OUT_OF_RANGE, f"{_first(vertices, np.abs(vertices) > largest)}; {limits}"


def _first(vertices: np.ndarray, bad: np.ndarray) -> str:
    row = int(np.flatnonzero(bad.any(axis=1))[0])
    return f"vertex {row} is {vertices[row].tolist()}"
