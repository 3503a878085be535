# SPDX-License-Identifier: Apache-2.0
"""Where the meshes of each pair are nearest, how fast they approach, and how far to slow down. No ROS.

The speed of approach is the larger of two. The mean speed, from the distances at both ends of the step, is of whichever
features were nearest then, so it is too small where others have become nearest during the step. The speed of the
features that are nearest now is too small where they move along each other and parts behind them come up.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import hpccd_core as hc

# Gap.inside -> whether mesh_a lies inside, whether mesh_b does.
SIDES_INSIDE = {None: (False, False), "a": (True, False), "b": (False, True), "both": (True, True)}

Floats = NDArray[np.float64]


def inside_code(sides: tuple[bool, bool]) -> int:
    """The value of `inside` in messages, of the first and the second side."""
    return sides[0] + 2 * sides[1]


def directions(gaps: Sequence[hc.Gap]) -> Floats:
    """(P, 3): unit vector from the first nearest point to the second; 0 if there is none."""
    found = np.zeros((len(gaps), 3))
    for row, gap in enumerate(gaps):
        if not gap.kind or gap.distance == 0:
            continue
        # Halved, because the difference of points of opposite signs may overflow.
        along = gap.points[1] / 2 - gap.points[0] / 2
        if largest := np.abs(along).max():  # points that differ by less than their rounding have no direction
            along = along / largest  # squares neither overflow nor vanish
            found[row] = along / np.linalg.norm(along)
    return found


def approach_speeds(before: Sequence[hc.Gap] | None, now: Sequence[hc.Gap], seconds: float) -> Floats:
    """(P,): decrease of the distances per second; > 0: approaching. NaN: unknown.

    before: gaps of the same pairs of meshes, ``seconds`` ago; None: unknown.

    Distances are compared, not the velocities of the nearest points: other points may be nearest in the next
    snapshot, and then their velocities are unrelated to the distance.
    """
    if before is None or len(before) != len(now) or not seconds > 0:
        return np.full(len(now), np.nan)
    then, distances = (np.array([gap.distance for gap in gaps], dtype=float) for gaps in (before, now))
    known = np.isfinite(then) & np.isfinite(distances)
    speeds = np.full(len(now), np.nan)
    speeds[known] = (then[known] - distances[known]) / seconds
    return speeds


def approached(gaps: Sequence[hc.Gap], start: np.ndarray, end: np.ndarray) -> Floats:
    """(P,): minus the derivative of each distance along the motion of its nearest features in the step; NaN: there are
    none. start, end: (V, 3), of the scene; ``gaps``: at the end.
    """
    found = np.full(len(gaps), np.nan)
    with np.errstate(over="ignore", invalid="ignore"):
        for row, gap in enumerate(gaps):
            if len(gap.vertices):
                moved = end[gap.vertices].astype(np.float64) - start[gap.vertices]
                found[row] = -gap.weights @ (moved @ gap.normal)
    return found


def closing_speeds(
    before: Sequence[hc.Gap] | None, now: Sequence[hc.Gap], moved: NDArray | None, seconds: float
) -> Floats:
    """(P,): the larger of both speeds of approach, per second; NaN: unknown. before: `approach_speeds`; moved:
    `approached`."""
    speeds = approach_speeds(before, now, seconds)
    if moved is None or not seconds > 0:
        return speeds
    return np.where(np.isnan(speeds), np.nan, np.fmax(speeds, moved / seconds))


def times_to_contact(gaps: Sequence[hc.Gap], speeds: Floats) -> Floats:
    """(P,): s; 0: they touch, or one is inside the other; +inf: they do not approach; NaN: unknown. speeds:
    `closing_speeds`."""
    times = np.full(len(gaps), np.nan)
    for row, (gap, speed) in enumerate(zip(gaps, speeds, strict=True)):
        if gap.kind and (gap.distance <= 0 or gap.inside):
            times[row] = 0.0
        elif gap.kind and not np.isnan(speed):
            times[row] = gap.distance / float(speed) if speed > 0 else np.inf
    return times


def nearest(gaps: Sequence[hc.Gap]) -> int | None:
    """Row of the smallest distance of different meshes, inside before all; the first of several; None: there is
    none."""
    rows = [row for row, gap in enumerate(gaps) if gap.kind and gap.mesh_a != gap.mesh_b]
    return min(rows, key=lambda row: (gaps[row].inside is None, gaps[row].distance), default=None)


@dataclass(frozen=True)
class Slowdown:
    """``scale``: of the speed, from 0 to 1; ``pair``: names of the meshes for which it is below 1."""

    scale: float = 1.0
    pair: tuple[str, str] | None = None


def slowdown(gaps: Sequence[hc.Gap], speeds: Floats, distance: float, time: float) -> Slowdown:
    """The least min(1, (gap - distance) / (speed * time)) of all pairs, and 0 where a speed is unknown. speeds:
    `closing_speeds`; time: s."""
    least = Slowdown()
    for gap, speed in zip(gaps, speeds, strict=True):
        if gap.kind and (scale := _scale(gap.distance - distance, float(speed) * time)) < least.scale:
            least = Slowdown(scale, (gap.mesh_a, gap.mesh_b))
    return least


def _scale(room: float, reach: float) -> float:
    if reach <= 0:
        return 1.0
    scale = room / reach  # inf / inf, and whatever is unknown, is NaN
    return min(1.0, scale) if scale > 0 else 0.0
