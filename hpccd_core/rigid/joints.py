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
second derivative e.x'': at most max |x''| / 8. For one of n equal parts: max |x''| / (8 n**2). For max |x''| two bounds
hold, and the less is taken: the sum above, that of the issue of joints that all turn alike; and |x''| in the middle of
the step, plus max |x'''| / 2, which sees turns that cancel. In the middle, of a link within `girth` of its centre c,

    |x''| <= |sum_j D_j (2 sum_(i<j) D_i w_i + D_j w_j) x J_j(c)| + (|W'| + |W|**2) girth,

where i, and the second term, count where they turn, W = sum D_j w_j and W' = sum over i < j of D_i D_j w_i x w_j.

**Whatever the speed.** Up to the origin of the first joint that moves nothing moves. From there no point gets farther
than the sum of all offsets, slides and the body's radius beyond it, the span: curve and straight line lie in that ball,
and deviate by at most its diameter. So a joint that jumps by a million radians has a bound as large as the robot.

As with screws the points of edges and faces deviate no more than vertices do. The poses of the middle are computed:
each length above is off by the relative error of `rounding.at_chain`, for which eight times that stands.

The core computes what is derived here (hpccd_core/src/rigid/joint_bounds.cpp); test/rigid/joints_oracle.py is the same
in Python, bit-identical.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np

from hpccd_core.joint_chains import JointBounds, JointChain, JointKind, placed
from hpccd_core.rigid import rounding
from hpccd_core.rigid.body import Body
from hpccd_core.rigid.rounding import dot
from hpccd_core.rigid.transform import IDENTITY, Rigid

TURNING = ("revolute", "continuous")
KINDS = (*TURNING, "prismatic", "fixed")
_OF_CORE = {**dict.fromkeys(TURNING, JointKind.turning), "prismatic": JointKind.sliding, "fixed": JointKind.fixed}


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
    def numbers(self) -> tuple[float, ...]:
        """As the core takes them: the last is not below the distance of its origin from that of its parent."""
        origin = self.origin
        return (*origin.quaternion.tolist(), *origin.shift.tolist(), *self.axis.tolist(), rounding.length(origin.shift))


class Chain:
    """All joints of a robot, in the order of their tree. Raises ValueError: a parent does not come before its joint."""

    def __init__(self, joints: Sequence[Joint]) -> None:
        self.joints = tuple(joints)
        for number, joint in enumerate(self.joints):
            if not -1 <= joint.parent < number:
                raise ValueError(
                    f"joints: the parent of joint {number} is {joint.parent}; it must come before it, or be -1"
                )
        self.continuous = [number for number, joint in enumerate(self.joints) if joint.kind == "continuous"]
        numbers = np.array([joint.numbers for joint in self.joints], np.float64).reshape(-1, 11)
        kinds, parents = [_OF_CORE[joint.kind] for joint in self.joints], [joint.parent for joint in self.joints]
        self.core = JointChain(kinds, parents, numbers)

    def poses(self, values: np.ndarray, base: Rigid) -> np.ndarray:
        """(m,7) float64: quaternion and shift of each joint's link. values (m,): what fixed joints have does not
        matter."""
        return self.core.poses(values, base.quaternion, base.shift)


def as_rigid(poses: np.ndarray) -> list[Rigid]:
    """poses: (m,7) as of `Chain.poses`."""
    return [Rigid(quaternion, shift) for quaternion, shift in zip(poses[:, :4], poses[:, 4:], strict=True)]


class JointStep:
    """All joints of a robot between two sets of values, one for each joint; what fixed ones have does not matter.

    A continuous joint goes the shorter way. ``base``: where the robot stands, fixed through the step. known: what
    `pose_rows` gives for some fractions, where it was computed before.
    """

    def __init__(
        self,
        joints: Sequence[Joint] | Chain,
        start: Sequence[float] | np.ndarray,
        end: Sequence[float] | np.ndarray,
        base: Rigid = IDENTITY,
        known: Mapping[float, np.ndarray] = MappingProxyType({}),
    ) -> None:
        self.chain = joints if isinstance(joints, Chain) else Chain(joints)
        self.base = base
        self.start = _values("start", start, self.joints)
        self.end = _values("end", end, self.joints)
        for number in self.chain.continuous:
            change = math.remainder(self.end[number] - self.start[number], 2 * math.pi)
            self.end[number] = self.start[number] + change
        self.speed = self.end - self.start
        self._rows = dict(known)

    @property
    def joints(self) -> tuple[Joint, ...]:
        return self.chain.joints

    def pose_rows(self, t: float) -> np.ndarray:
        """(m,7) float64, as of `Chain.poses`, at the fraction t in [0, 1], computed once."""
        if t not in self._rows:
            values = self.end if t >= 1.0 else self.start + self.speed * t
            self._rows[t] = self.chain.poses(values, self.base)
        return self._rows[t]

    def poses(self, t: float) -> list[Rigid]:
        """Pose of each joint's link at the fraction t in [0, 1]."""
        return as_rigid(self.pose_rows(t))

    @cached_property
    def bounds(self) -> JointBounds:
        """Bounds on the motion of all links."""
        return JointBounds(self.chain.core, self.start, self.end, self.base.quaternion, self.base.shift)


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
        vertices = self.body.vertices
        return placed(self.step.pose_rows(cut / parts), [(self.link, len(vertices))], vertices)

    def deviation(self, parts: int) -> float:
        acceleration, span, _ = self._bounds
        return rounding.up(min(acceleration / (8.0 * parts * parts), 2.0 * span))

    def rounding(self, parts: int) -> float:
        return self._bounds[2]

    @cached_property
    def _bounds(self) -> tuple[float, float, float]:
        """Not below max |x''| of all its points through the step; from the origin of the first joint that moves to the
        farthest point that the link may have in it; how far a vertex at a cut is from where it should be."""
        body = self.body
        return self.step.bounds.of_link(self.link, body.radius, body.girth, body.centre)


def _values(name: str, values: Sequence[float] | np.ndarray, joints: Sequence[Joint]) -> np.ndarray:
    found = np.array(values, np.float64)
    if found.shape != (len(joints),) or not np.isfinite(found).all():
        raise ValueError(f"{name}: expected a finite number for each of the {len(joints)} joints")
    return found
