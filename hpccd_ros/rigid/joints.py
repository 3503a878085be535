# SPDX-License-Identifier: Apache-2.0
"""The motion of links whose joints go at constant speed through a step, and how far it is from straight lines.

Such a motion is no screw: two joints that turn against each other leave a link unrotated, and yet bend its path.

A point x fixed to a link depends on the values q_1, ..., q_m of the joints on its way to the base, nearest the base
first. A joint that turns has the axis w_i through o_i, one that slides the direction a_i, both moved by the joints
before it. With the column J_j = dx/dq_j, which is w_j x (x - o_j) where j turns, and a_j where it slides:

    d2x / dq_i dq_j  for i <= j  is  w_i x J_j  where i turns,  and 0 where i slides,

since joint i takes all that J_j is made of along: turning it turns J_j, sliding it shifts x and o_j alike. (i = j: a
turn about its own axis leaves w_j and o_j; a_j is not changed by its own slide.) Once more, for i <= j <= k,
d3x / dq_i dq_j dq_k is w_i x (w_j x J_k) where i and j turn, else 0. |J_j| = G_j is the distance of x from the axis j,
at most that from o_j; 1 where j slides. q_i goes at the constant speed D_i, so that with S_j = sum over i < j that turn
of |D_i|

    |x'|   <= sum_j G_j |D_j|
    |x''|  <= sum_j G_j ((S_j + |D_j|)**2 - S_j**2)   j turns;   2 S_j |D_j|      j slides
    |x'''| <= sum_j G_j ((S_j + |D_j|)**3 - S_j**3)   j turns;   3 S_j**2 |D_j|   j slides

(the powers count the pairs and triples whose last is j, which contains a sliding joint only as that last one, once).

**Greatest distances.** From the tip to the base: G_j in the middle of the step, plus what joints beyond j can change of
it in half a step, sum over k > j of G_k |D_k| / 2, as x moves no faster than that relative to axis j.

**The deviation.** For a curve over unit time and any unit vector e, e.x less its chord is 0 at both ends and has the
second derivative e.x'': at most max |x''| / 8. Of one of n equal parts, max |x''| / (8 n**2). For max |x''| two bounds
hold, and the less is taken: the sum above, that of the issue of joints that all turn alike; and |x''| in the middle of
the step, plus max |x'''| / 2, which sees turns that cancel. In the middle, of a link within `girth` of its centre c,

    |x''| <= |sum_j D_j (2 sum_(i<j) D_i w_i + D_j w_j) x J_j(c)| + (|W'| + |W|**2) girth,

where i, and the second term, count where they turn, W = sum D_j w_j and W' = sum over i < j of D_i D_j w_i x w_j.

**Whatever the speed.** Up to the origin of the first joint that moves nothing moves. From there no point gets farther
than the sum of all offsets, slides and the body's radius beyond it, `_span`: curve and straight line lie in that ball,
and deviate by at most its diameter. So a joint that jumps by a million radians has a bound as large as the robot.

As with screws the points of edges and faces deviate no more than vertices do. The poses of the middle are computed:
each length above is off by the relative error of `rounding.at_chain`, for which `_slack` stands eight times.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np

from hpccd_ros.rigid import rounding
from hpccd_ros.rigid.body import Body
from hpccd_ros.rigid.sums import dot, in_order
from hpccd_ros.rigid.transform import IDENTITY, Rigid, rotated

TURNING = ("revolute", "continuous")
KINDS = (*TURNING, "prismatic", "fixed")
Vector = tuple[float, float, float]  # numpy takes longer for three numbers


@dataclass(frozen=True, eq=False)
class Joint:
    """``kind``: one of KINDS. ``parent``: number of the joint whose link it sits on, less than its own; -1: the base.

    ``origin``: its frame in that of the parent's link, at the value 0. ``axis`` (3,) in its own frame, of length 1.
    The link of a joint has the joint's number, and the joint's frame, moved.
    """

    kind: str
    parent: int
    origin: Rigid
    axis: np.ndarray

    @classmethod
    def of(cls, kind: str, parent: int, origin: Rigid, axis: Sequence[float] = (1.0, 0.0, 0.0)) -> "Joint":
        """Checked, the axis brought to length 1. Raises ValueError."""
        if kind not in KINDS:
            raise ValueError(f"kind: {kind!r} is not known; choose from {', '.join(KINDS)}")
        direction = np.array(axis, np.float64)
        size = math.sqrt(dot(direction, direction)) if direction.shape == (3,) else 0.0
        if not (math.isfinite(size) and size > 1e-100):
            raise ValueError(f"axis {list(axis)}: needs three finite numbers that are not all 0")
        return cls(kind, parent, origin, direction / size)

    @property
    def turns(self) -> bool:
        return self.kind in TURNING

    @cached_property
    def offset(self) -> float:
        """Not below the distance of its origin from that of its parent."""
        return rounding.length(self.origin.shift)

    def moved(self, value: float) -> Rigid:
        """From its own frame at 0 to that at ``value``: radians, or the unit of coordinates."""
        if self.turns:
            return Rigid(np.append(self.axis * math.sin(value / 2), math.cos(value / 2)), np.zeros(3))
        return Rigid(IDENTITY.quaternion, self.axis * value if self.kind == "prismatic" else np.zeros(3))


class JointStep:
    """All joints of a robot between two sets of values, one for each joint; what fixed ones have does not matter.

    A continuous joint goes the shorter way. ``base``: where the robot stands, fixed through the step. known: what
    `poses` gives for some fractions, where it was computed before.
    """

    def __init__(
        self,
        joints: Sequence[Joint],
        start: Sequence[float],
        end: Sequence[float],
        base: Rigid = IDENTITY,
        known: Mapping[float, list[Rigid]] = MappingProxyType({}),
    ) -> None:
        self.joints = tuple(joints)
        self.base = base
        for number, joint in enumerate(self.joints):
            if not -1 <= joint.parent < number:
                raise ValueError(
                    f"joints: the parent of joint {number} is {joint.parent}; it must come before it, or be -1"
                )
        self.start = _values("start", start, self.joints)
        self.end = _values("end", end, self.joints)
        for number, joint in enumerate(self.joints):
            if joint.kind == "continuous":
                change = math.remainder(self.end[number] - self.start[number], 2 * math.pi)
                self.end[number] = self.start[number] + change
        self.speed = self.end - self.start
        self._poses = dict(known)

    def poses(self, t: float) -> list[Rigid]:
        """Of each joint's link at the fraction t in [0, 1], computed once."""
        if t not in self._poses:
            values = self.end if t >= 1.0 else self.start + self.speed * t
            poses: list[Rigid] = []
            for joint, value in zip(self.joints, values.tolist(), strict=True):
                before = self.base if joint.parent < 0 else poses[joint.parent]
                poses.append(before.after(joint.origin).after(joint.moved(value)))
            self._poses[t] = poses
        return self._poses[t]

    @cached_property
    def middle(self) -> list[tuple[Vector, Vector]]:
        """Of each joint in the middle of the step: its axis, and a point of it."""
        return [
            (_vector(rotated(pose.rotation(), joint.axis)), _vector(pose.shift))
            for joint, pose in zip(self.joints, self.poses(0.5), strict=True)
        ]

    def way(self, link: int) -> list[int]:
        """Numbers of the joints from the base to this link."""
        numbers = []
        while link >= 0:
            numbers.append(link)
            link = self.joints[link].parent
        return numbers[::-1]


@dataclass(frozen=True, eq=False)
class LinkMotion:
    """The geometry ``body`` of the link of joint number ``link``, in that joint's frame. ``ends``: its vertices at the
    start and at the end, where they were computed before."""

    step: JointStep
    link: int
    body: Body
    ends: tuple[np.ndarray, np.ndarray] | None = None

    def vertices(self, cut: int, parts: int) -> np.ndarray:
        if self.ends is not None and cut in (0, parts):
            return self.ends[cut > 0]
        return self.step.poses(cut / parts)[self.link].apply(self.body.vertices)

    def deviation(self, parts: int) -> float:
        return rounding.up(min(self._acceleration / (8.0 * parts * parts), 2.0 * self._span))

    def rounding(self, parts: int) -> float:
        values = in_order(abs(self.step.start[k]) + abs(self.step.speed[k]) for k in self._way)
        return rounding.at_chain(len(self._way), self._reach, float(values))

    @cached_property
    def _way(self) -> list[int]:
        return self.step.way(self.link)

    @cached_property
    def _reach(self) -> float:
        """From the origin of the world to the farthest point that the link may have in this step."""
        return rounding.up(rounding.length(self.step.base.shift) + self._beyond(self._way))

    @cached_property
    def _span(self) -> float:
        """From the origin of the first joint that moves to the farthest point that the link may have in this step."""
        moving = [place for place, k in enumerate(self._way) if self._moves(k)]
        if not moving:
            return 0.0
        first, *others = self._way[moving[0] :]
        return rounding.up(self._slid(first) + self._beyond(others))

    def _beyond(self, joints: Sequence[int]) -> float:
        """The body, with all offsets and slides of these joints of its way."""
        offsets = in_order(self.step.joints[k].offset + self._slid(k) for k in joints)
        return self.body.radius + float(offsets)

    def _slid(self, k: int) -> float:
        slides = self.step.joints[k].kind == "prismatic"
        return max(abs(float(self.step.start[k])), abs(float(self.step.end[k]))) if slides else 0.0

    def _moves(self, k: int) -> bool:
        return self.step.joints[k].kind != "fixed" and self.step.speed[k] != 0.0

    @cached_property
    def _slack(self) -> float:
        """What a length computed from the poses of the middle may be off."""
        return 8.0 * self.rounding(2)

    @cached_property
    def _acceleration(self) -> float:
        """Not below max |x''| of all its points through the step."""
        moving = [k for k in self._way if self._moves(k)]
        turning = [self.step.joints[k].turns for k in moving]
        speed = [abs(float(self.step.speed[k])) for k in moving]
        if not any(turning):
            return 0.0
        before, turned = [], 0.0
        for s, turns in zip(speed, turning, strict=True):
            before.append(turned)
            turned += s if turns else 0.0
        reach = self._distances(moving, speed)
        second = third = 0.0
        for turns, d, s, g in zip(turning, speed, before, reach, strict=True):
            second += g * (d * (2 * s + d) if turns else 2 * s * d)
            third += g * (d * (3 * s * (s + d) + d * d) if turns else 3 * s * s * d)
        return rounding.up(min(second, self._in_the_middle(moving) + third / 2))

    def _distances(self, moving: list[int], speed: list[float]) -> list[float]:
        """G of each moving joint."""
        axes, centre = self.step.middle, self._centre
        found, swept = [], 0.0
        for k, d in zip(reversed(moving), reversed(speed), strict=True):
            distance = 1.0
            if self.step.joints[k].turns:
                axis, origin = axes[k]
                distance = _length(_cross(axis, _less(centre, origin))) + self.body.girth + self._slack + swept
            found.append(distance)
            swept += distance * d / 2
        return found[::-1]

    def _in_the_middle(self, moving: list[int]) -> float:
        """Not below |x''| of any of its points at t = 1/2."""
        axes, centre = self.step.middle, self._centre
        of_centre = turning = of_turning = (0.0, 0.0, 0.0)
        total = slides = 0.0
        for k in moving:
            axis, origin = axes[k]
            d = float(self.step.speed[k])
            own = _times(d, axis)
            if self.step.joints[k].turns:
                column = _cross(own, _less(centre, origin))
                of_centre = _plus(of_centre, _cross(_plus(_times(2.0, turning), own), column))
                of_turning = _plus(of_turning, _cross(turning, own))
                turning = _plus(turning, own)
                total += abs(d)
            else:
                of_centre = _plus(of_centre, _cross(_times(2.0, turning), own))
                slides += abs(d)
        spin = _length(of_turning) + _length(turning) ** 2
        # An axis is off by the slack's part of the reach; each product of two of them by as much, times the turns.
        lost = self._slack * (total * total + 2 * total * slides / max(self._reach, 1e-100))
        return rounding.up(_length(of_centre) + spin * self.body.girth + lost)

    @cached_property
    def _centre(self) -> Vector:
        pose = self.step.poses(0.5)[self.link]
        return _vector(pose.apply(self.body.centre[None, :])[0])


def _values(name: str, values: Sequence[float], joints: Sequence[Joint]) -> np.ndarray:
    found = np.array(values, np.float64)
    if found.shape != (len(joints),) or not np.isfinite(found).all():
        raise ValueError(f"{name}: expected a finite number for each of the {len(joints)} joints")
    return found


def _vector(array: np.ndarray) -> Vector:
    x, y, z = array.tolist()
    return x, y, z


def _plus(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _less(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _times(k: float, a: Vector) -> Vector:
    return k * a[0], k * a[1], k * a[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _length(a: Vector) -> float:
    """Not below it."""
    squared = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
    return rounding.up(math.sqrt(squared)) + rounding.TINY if any(a) else 0.0
