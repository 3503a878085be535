# SPDX-License-Identifier: Apache-2.0
"""The number of parts of a step, and how much the separations of its meshes grow."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hpccd_core.rigid import rounding
from hpccd_core.rigid.motion import Motion


@dataclass(frozen=True)
class Cut:
    """How a step is divided.

    Attributes
    ----------
    parts : int
        Number of parts of equal duration.
    deviation : float
        The greatest deviation of all meshes with that many parts.
    enough : bool
        False if the deviation stays above the tolerance because more than `most` parts would be needed. The margins
        hold all the same: nothing is missed, more is reported in excess.
    """

    parts: int
    deviation: float
    enough: bool


def fewest_parts(motions: Sequence[Motion], tolerance: float, most: int) -> Cut:
    """The fewest parts with which the deviation of each mesh is at most a tolerance.

    Parameters
    ----------
    motions : sequence of Motion
        Motion of each mesh; all are divided at the same times.
    tolerance : float
        Largest deviation, in the unit of the coordinates, above 0. For positions in metres 1e-3 suits most robots.
    most : int
        Largest number of parts.

    Returns
    -------
    Cut

    Raises
    ------
    ValueError
        If `tolerance` is not above 0, or `most` below 1.
    """
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
    """Upper bound on the error of one mesh at any time of the step.

    Attributes
    ----------
    deviation : float
        Of the straight lines from the true motion, in the unit of the coordinates.
    rounding : float
        Of the computed positions.
    """

    deviation: float
    rounding: float

    @classmethod
    def of(cls, motion: Motion, parts: int) -> "Margin":
        """The margin of a motion that is divided into this number of parts."""
        return cls(motion.deviation(parts), motion.rounding(parts))

    @property
    def sum(self) -> float:
        """Deviation and rounding together, rounded up."""
        return rounding.up(self.deviation + self.rounding)


def bound(margins: Iterable[Margin]) -> float:
    """How much the separation of a pair of meshes grows.

    Parameters
    ----------
    margins : iterable of Margin
        Those of both meshes.

    Returns
    -------
    float
        0 if both motions are exact.
    """
    return rounding.up(math.fsum(margin.sum for margin in margins))


def grown(separation: float, a: Margin, b: Margin) -> float:
    """The separation at which no contact of the true motions is missed.

    Parameters
    ----------
    separation : float
        Separation of the true motions, in the unit of the coordinates.
    a, b : Margin
        Margins of both meshes.

    Returns
    -------
    float
        For :meth:`Detector.set_separation`. Reported pairs are within `separation` plus twice the bound.
    """
    grow = bound((a, b))
    return rounding.up(separation + grow) if grow else separation


def all_grown(separations: NDArray[np.float64], margins: Sequence[Margin]) -> NDArray[np.float64]:
    """:func:`grown` of each pair of different meshes, bit-identical; within a mesh nothing grows.

    Parameters
    ----------
    separations : ndarray, shape (K, K), float64
    margins : sequence of K Margin

    Returns
    -------
    ndarray, shape (K, K), float64
        For :meth:`Detector.set_separations`.

    Raises
    ------
    ValueError
        If there is not one margin for each mesh.
    """
    if np.shape(separations) != (len(margins), len(margins)):
        raise ValueError(f"margins: {len(margins)} for separations of shape {np.shape(separations)}; give one a mesh")
    sums = np.array([margin.sum for margin in margins])
    grow = rounding.up(sums[:, None] + sums)  # a sum of two is rounded once, as by fsum
    np.fill_diagonal(grow, 0.0)
    return np.where(grow > 0.0, rounding.up(separations + grow), separations)
