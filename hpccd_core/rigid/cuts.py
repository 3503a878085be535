# SPDX-License-Identifier: Apache-2.0
"""Into how many parts a step is cut, and how much farther apart a pair of meshes may then seem."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hpccd_core.rigid import rounding
from hpccd_core.rigid.motion import Motion


@dataclass(frozen=True)
class Cut:
    """``parts``: of equal duration. ``deviation``: the greatest of all meshes with this number.

    ``enough``: False where it stays above the tolerance, because more than ``most`` parts would be needed. The margins
    hold all the same: nothing is missed, more is reported in excess.
    """

    parts: int
    deviation: float
    enough: bool


def fewest_parts(motions: Sequence[Motion], tolerance: float, most: int) -> Cut:
    """The fewest with which the deviation of each mesh is at most ``tolerance``; all are cut at the same times."""
    if not tolerance > 0.0:
        raise ValueError(f"tolerance {tolerance}: must be above 0")
    if most < 1:
        raise ValueError(f"most {most}: a step has at least one part")
    parts = 1
    for motion in motions:
        parts = _fewest(motion, tolerance, parts, most)
    deviation = max((motion.deviation(parts) for motion in motions), default=0.0)
    return Cut(parts, deviation, deviation <= tolerance)


def _fewest(motion: Motion, tolerance: float, parts: int, most: int) -> int:
    """At least ``parts``. More parts never deviate more, so halving finds the fewest."""
    if motion.deviation(parts) <= tolerance:
        return parts
    if motion.deviation(most) > tolerance:
        return most
    # The deviation falls nearly with the square of the parts.
    guess = math.ceil(parts * math.sqrt(motion.deviation(parts) / tolerance))
    low, high = parts, most
    while high - low > 1:
        middle = min(max(guess, low + 1), high - 1)
        if motion.deviation(middle) <= tolerance:
            high, guess = middle, middle - 1
        else:
            low, guess = middle, (middle + high) // 2 if guess > middle else middle + 1
    return high


@dataclass(frozen=True)
class Margin:
    """By how much one mesh may be off at any time of the step: ``deviation`` from straight lines, ``rounding``."""

    deviation: float
    rounding: float

    @classmethod
    def of(cls, motion: Motion, parts: int) -> "Margin":
        return cls(motion.deviation(parts), motion.rounding(parts))

    @property
    def sum(self) -> float:
        return rounding.up(self.deviation + self.rounding)


def bound(margins: Iterable[Margin]) -> float:
    """Of a pair of meshes, of one with itself twice the same: what its separation grows by; 0 where both are exact."""
    return rounding.up(math.fsum(margin.sum for margin in margins))


def grown(separation: float, a: Margin, b: Margin) -> float:
    """The separation at which no contact within ``separation`` is missed; what it finds is within that + 2 bounds."""
    grow = bound((a, b))
    return rounding.up(separation + grow) if grow else separation


def all_grown(separations: NDArray[np.float64], margins: Sequence[Margin]) -> NDArray[np.float64]:
    """(K, K): `grown`, to the bit, of each pair of different meshes; within a mesh nothing grows."""
    sums = np.array([margin.sum for margin in margins])
    grow = rounding.up(sums[:, None] + sums)  # a sum of two is rounded once, as by fsum
    np.fill_diagonal(grow, 0.0)
    return np.where(grow > 0.0, rounding.up(separations + grow), separations)
