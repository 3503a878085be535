# SPDX-License-Identifier: Apache-2.0
"""Which positions the core computes with. No ROS."""

import numpy as np

from hpccd_core.arguments import LARGEST_COORDINATE
from hpccd_ros.frames.drops import Reason


def unusable_coordinates(vertices: np.ndarray) -> tuple[Reason, str] | None:
    """Why the core cannot take these positions, (n,3), or None."""
    # Two reductions, as they need no array of their own; NaN passes through both and compares false.
    if not len(vertices) or (
        -LARGEST_COORDINATE <= float(vertices.min()) and float(vertices.max()) <= LARGEST_COORDINATE
    ):
        return None
    if not (finite := np.isfinite(vertices)).all():
        return Reason.NOT_FINITE, f"{_first(vertices, ~finite)}; coordinates must be finite"
    too_far = np.abs(vertices) > LARGEST_COORDINATE
    return (
        Reason.OUT_OF_RANGE,
        f"{_first(vertices, too_far)}; coordinates must lie in [-{LARGEST_COORDINATE:g}, {LARGEST_COORDINATE:g}]",
    )


def _first(vertices: np.ndarray, bad: np.ndarray) -> str:
    row = int(np.flatnonzero(bad.any(axis=1))[0])
    return f"vertex {row} is {vertices[row].tolist()}"
