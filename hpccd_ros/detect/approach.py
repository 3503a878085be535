# SPDX-License-Identifier: Apache-2.0
"""Where the nearest parts of two meshes are from each other, and how fast they near. No ROS."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

import hpccd_core as hc


def directions(gaps: Sequence[hc.Gap]) -> NDArray[np.float64]:
    """(P, 3): unit vector from the first of the nearest points to the second; 0 where there is none."""
    found = np.zeros((len(gaps), 3))
    for row, gap in enumerate(gaps):
        if not gap.kind or gap.distance == 0:
            continue
        # Halved, as points of opposite signs may be farther apart than numbers go.
        along = gap.points[1] / 2 - gap.points[0] / 2
        if largest := np.abs(along).max():  # points that are told apart by less than their rounding have no direction
            along = along / largest  # squares neither overflow nor vanish
            found[row] = along / np.linalg.norm(along)
    return found


def approach_speeds(before: Sequence[hc.Gap] | None, now: Sequence[hc.Gap], seconds: float) -> NDArray[np.float64]:
    """(P,): how much smaller the distances have become in a second; > 0: nearing. NaN where it is not known.

    before: of the same pairs of meshes, so many ``seconds`` ago; None: not known.

    Distances are compared, not the velocities of the nearest points: which points are nearest changes from one
    snapshot to the next, and where it does their velocities say nothing of the distance.
    """
    if before is None or len(before) != len(now) or not seconds > 0:
        return np.full(len(now), np.nan)
    then, distances = (np.array([gap.distance for gap in gaps], dtype=float) for gaps in (before, now))
    known = np.isfinite(then) & np.isfinite(distances)
    speeds = np.full(len(now), np.nan)
    speeds[known] = (then[known] - distances[known]) / seconds
    return speeds
