# SPDX-License-Identifier: Apache-2.0
"""The motion that two poses are taken to mean: the screw of at most half a turn, at constant speed.

A screw turns about a fixed axis and slides along it. Which one: with d = q_1 q_0* the turn between the poses, of the
two quaternions d and -d that one whose w is not negative; at half a turn, where w is 0, the one whose first component
that is not 0 is positive. So q and -q give the same motion. Where rounding hides the sign of w, that of the computed w
counts.

**Points on the way.** With h = half the angle, w the axis, c = x_1 - x_0 the chord of a point and c' its part across
the axis, the point is at the fraction t at

    x(t) = x_0 + t (c - c') + sin(h t) / sin(h) (cos(h (1 - t)) c' - sin(h (1 - t)) w x c'),

the chord from x_0 to the point of the arc at the angle 2 h t, which is as long as 2 r sin(h t) and turned back from c'
by h (1 - t). It needs no point of the axis, which for a small angle may be anywhere.

**How far the straight line is off.** Let the point be at the distance r from the axis, and u = h (2 t - 1) from -h to
h. Along the axis both motions are the same. Across it, in the plane with the axis as origin and the middle of the arc
on the first coordinate, the arc is at r (cos u, sin u) and the chord, gone through uniformly, at r (C, s u), C = cos h,
s = sin(h) / h. The square of their distance is r**2 f(u),

    f(u)  = (cos u - C)**2 + (sin u - s u)**2,      f even,
    f'(u) = 2 [sin u (C - s) - s u (cos u - s)] = 2 u k(u),   k(u) = (sin u / u) (C - s) - s cos u + s**2,
    k'(u) = (sin u / u)' (C - s) + s sin u.

For 0 < u <= h <= pi: sin u / u falls, C <= s (h cos h <= sin h, as the difference is 0 at 0 and falls), so that the
first product is not negative; nor is the second. So k rises up to k(h) = s (C - s) - s C + s**2 = 0, k <= 0, f' <= 0: f
is greatest at u = 0, and the deviation is at most

    r (1 - cos h) = (|c'| / 2) tan(h / 2),         |c'| = 2 r sin h,

the sagitta. For one of n equal parts it is r (1 - cos(h / n)) = |c'| sin(h / 2n)**2 / sin(h). This is proven up to h =
pi, so the rounding of a half turn does no harm. A point of an edge or a face is an average of vertices with weights
that do not change, on the true motion and on straight lines: its deviation is at most the greatest of theirs.

**In floats.** |c'| comes from the matrix R_1 - R_0 and the shifts. Each matrix is off by 53 u (rounding.py), their
difference by 110 u, which is multiplied by r_v and by F = sin(h/2n)**2 / sin(h) <= 1/2; the axis is off by 24 u / sin
h, which moves |c'| by twice that times |c|, and F / sin h <= 1/2: 24 u |c|; h is off by 33 u, and F changes by at most
half of that, times |c|; evaluation takes 20 u |c|. With |c| <= 2 r_v + |p_1 - p_0| all this is less than
128 u (2 r_v + |p_1 - p_0|), which `deviation` adds. Poses with the same rotation have no deviation at all.
"""

import math
from dataclasses import dataclass

import numpy as np

from hpccd_core.rigid import rounding
from hpccd_core.rigid.body import Body
from hpccd_core.rigid.rounding import dot
from hpccd_core.rigid.transform import Rigid, product, rotated

# Turns below it move no coordinate that a double can hold, and the square of their sine would underflow.
_NO_TURN = 1e-140


@dataclass(frozen=True, eq=False)
class Screw:
    """The motion between two poses: rotation about a fixed axis and translation along it, at constant speed.

    Attributes
    ----------
    start, end : Rigid
    axis : ndarray, shape (3,), float64
        Unit vector; zeros without rotation.
    half : float
        Half of the angle in radians, 0 to pi/2.
    """

    start: Rigid
    end: Rigid
    axis: np.ndarray
    half: float

    @classmethod
    def between(cls, start: Rigid, end: Rigid) -> "Screw":
        """The screw of at most half a turn from `start` to `end`."""
        turn = product(end.quaternion, start.quaternion * [-1, -1, -1, 1])
        x, y, z, w = turn.tolist()
        if w < 0 or (w == 0 and next((component for component in (x, y, z) if component), 1.0) < 0):
            x, y, z, w = -x, -y, -z, -w
        sine = math.sqrt(x * x + y * y + z * z)
        if sine < _NO_TURN:
            return cls(start, end, np.zeros(3), 0.0)
        return cls(start, end, np.array([x, y, z]) / sine, math.atan2(sine, w))

    @property
    def angle(self) -> float:
        """The angle of the rotation, in radians."""
        return 2.0 * self.half

    @property
    def slide(self) -> float:
        """How far it goes along the axis; where nothing turns, how far it goes."""
        way = self.end.shift - self.start.shift
        return dot(way, self.axis) if self.half else math.sqrt(dot(way, way))

    @property
    def point(self) -> np.ndarray | None:
        """The point of the axis nearest to the middle between both shifts; None where nothing turns.

        For drawings: for a small angle it is far away and imprecise, and nothing here computes with it.
        """
        if not self.half:
            return None
        way = self.end.shift - self.start.shift
        middle = self.start.shift / 2 + self.end.shift / 2
        return middle + _cross(self.axis, way) * (math.cos(self.half) / (2.0 * math.sin(self.half)))

    def pose(self, t: float) -> Rigid:
        """At the fraction t in [0, 1]; the ends are bit-identical to those given."""
        if t <= 0.0:
            return self.start
        if t >= 1.0:
            return self.end
        way = self.end.shift - self.start.shift
        if not self.half:
            return Rigid(self.start.quaternion, self.start.shift + t * way)
        h = self.half
        part = math.sin(h * t) / math.sin(h)
        along = dot(way, self.axis) * self.axis
        across, beside = way - along, _cross(self.axis, way)
        turned = (part * math.cos(h * (1.0 - t))) * across - (part * math.sin(h * (1.0 - t))) * beside
        turn = np.append(self.axis * math.sin(h * t), math.cos(h * t))
        return Rigid(product(turn, self.start.quaternion), self.start.shift + (t * along + turned))

    def vertices(self, body: Body, t: float) -> np.ndarray:
        """(n,3) float64 at the fraction t."""
        return self.pose(t).apply(body.vertices)

    def deviation(self, body: Body, parts: int = 1, chord: float | None = None) -> float:
        """Not below the distance between a point on its arc and on the straight line of its part, at any time.

        chord: what `chord` gives for this body, where it is known.
        """
        same = self.start.quaternion, self.end.quaternion
        if np.array_equal(*same) or np.array_equal(same[0], -same[1]):
            return 0.0
        chord = self.chord(body) if chord is None else chord
        factor = math.sin(self.half / (2 * parts)) ** 2 / math.sin(self.half) if self.half else 0.0
        slack = 128.0 * rounding.U * (2.0 * body.radius + rounding.length(self.end.shift - self.start.shift))
        return rounding.up(chord * factor + slack)

    def chord(self, body: Body) -> float:
        """The greatest ``|c'|`` of its vertices, up to the rounding that `deviation` adds."""
        if not self.half:
            return 0.0
        # c' = A v + b. The projection is taken of the matrix: one pass over the vertices.
        matrix = self._across(self.end.rotation() - self.start.rotation())
        shift = self._across((self.end.shift - self.start.shift)[:, None])[:, 0]
        return rounding.longest(rotated(matrix, body.vertices) + shift)

    def _across(self, columns: np.ndarray) -> np.ndarray:
        """Without their parts along the axis: (3,k)."""
        w = self.axis
        along = w[0] * columns[0] + w[1] * columns[1] + w[2] * columns[2]
        across: np.ndarray = columns - w[:, None] * along
        return across


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    (ax, ay, az), (bx, by, bz) = a, b
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
