# SPDX-License-Identifier: Apache-2.0
"""Motions of the vertices of one mesh through a step, as cuts and margins use them."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from hpccd_core.rigid import rounding
from hpccd_core.rigid.body import Body
from hpccd_core.rigid.screw import Screw


class Motion(Protocol):
    """The motion of one mesh in a step that is divided into ``parts`` equal ones."""

    def vertices(self, cut: int, parts: int) -> np.ndarray:
        """(n,3) at the end of this number of parts: 0 is the start of the step. Not to be written to."""

    def deviation(self, parts: int) -> float:
        """Upper bound on the distance of the straight lines between exact positions from the motion, at any time."""

    def rounding(self, parts: int) -> float:
        """Upper bound on the error of a computed position at the ends of the parts."""


@dataclass(frozen=True, eq=False)
class ScrewMotion:
    """A rigid mesh that follows a screw between two poses.

    Attributes
    ----------
    body : Body
    screw : Screw
    """

    body: Body
    screw: Screw

    def vertices(self, cut: int, parts: int) -> np.ndarray:
        return self.screw.vertices(self.body, cut / parts)

    def deviation(self, parts: int) -> float:
        return self.screw.deviation(self.body, parts, self._chord)

    def rounding(self, parts: int) -> float:
        start, end = self.screw.start.shift, self.screw.end.shift
        far = max(rounding.length(start), rounding.length(end))
        if parts == 1:
            return rounding.at_pose(self.body.radius, far)
        return rounding.at_cut(self.body.radius, far, rounding.length(end - start))

    @cached_property
    def _chord(self) -> float:
        return self.screw.chord(self.body)


@dataclass(frozen=True, eq=False)
class Linear:
    """A mesh whose vertices move on straight lines: it deforms, or rests (the same array twice).

    Attributes
    ----------
    start, end : ndarray, shape (n, 3)
        Positions at both ends of the step.
    """

    start: np.ndarray
    end: np.ndarray

    def __post_init__(self) -> None:
        shapes = [vertices.shape if isinstance(vertices, np.ndarray) else None for vertices in (self.start, self.end)]
        if None in shapes:
            raise TypeError("start, end: expected arrays; convert with numpy.asarray")
        if shapes[0] != shapes[1]:  # they would be broadcast
            raise ValueError(f"start, end: expected two arrays of one shape (n, 3), got {shapes[0]} and {shapes[1]}")

    def vertices(self, cut: int, parts: int) -> np.ndarray:
        if cut == 0 or self.start is self.end:
            return self.start
        if cut == parts:
            return self.end
        start = self.start.astype(np.float64)
        return start + (self.end.astype(np.float64) - start) * (cut / parts)

    def deviation(self, parts: int) -> float:
        return 0.0

    def rounding(self, parts: int) -> float:
        if parts == 1 or self.start is self.end or not len(self.start):
            return 0.0
        return self._rounding

    @cached_property
    def _rounding(self) -> float:
        far = max(float(np.abs(self.start).max()), float(np.abs(self.end).max()))
        way = float(np.abs(self.end.astype(np.float64) - self.start).max())
        # The greatest coordinate, times sqrt(3), bounds the length: two passes without an array of squares.
        return rounding.linear(1.7320509 * way, 1.7320509 * far)
