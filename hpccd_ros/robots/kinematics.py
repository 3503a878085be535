# SPDX-License-Identifier: Apache-2.0
"""Positions of the links of a robot, and their motion while its joints change.

Between two states each joint moves at constant speed: a continuous one the shorter way, all others directly from value
to value, even by more than a turn. Mimic joints follow. Therefore a continuous joint that another one mimics by a
non-integer factor must be unwrapped, or the value of the follower jumps.

If the robot's base moves in the same step, its origin moves straight while it rotates at constant speed by at most half
a turn, as tf2 interpolates. That is the motion of two more joints before the root, a prismatic and a revolute one, so
that rigid/joints.py applies unchanged.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hpccd_core.rigid import rounding
from hpccd_core.rigid.body import Body
from hpccd_core.rigid.joints import Chain, Joint, JointStep, LinkMotion, as_rigid
from hpccd_core.rigid.rounding import dot
from hpccd_core.rigid.screw import Screw
from hpccd_core.rigid.transform import IDENTITY, Rigid
from hpccd_ros.base.quoting import listed
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.urdf import Description, RobotJoint

# Radians or metres: beyond this a double resolves less than a millionth, and no step is plausible.
LARGEST_VALUE = 1e9
_AHEAD = 2  # joints that move a base: a prismatic and a revolute one


@dataclass(frozen=True)
class _Followed:
    """The value of a joint is ``factor`` times that of ``joint``, plus ``offset``."""

    joint: str
    factor: float
    offset: float


class Kinematics:
    """``inputs``: names of the joints that need a value, in the order of the tree: those that move one of the links
    ``of_links`` (None: any link) and mimic no other joint. Other joints without a value are at 0.

    ``links``: names of all links, from the root on. `number` of a link is its index there.
    """

    def __init__(self, description: Description, of_links: Iterable[str] | None = None) -> None:
        joints = description.joints
        self.links = (description.root, *(joint.child for joint in joints))
        self._numbers = {name: number for number, name in enumerate(self.links)}
        named = {joint.name: joint for joint in joints}
        self._names = tuple(named)
        self.continuous = frozenset(joint.name for joint in joints if joint.kind == "continuous")
        self._followed = tuple(None if joint.kind == "fixed" else _followed(joint, named) for joint in joints)
        moved = _moved_by(joints, self.links if of_links is None else of_links)
        needed = {f.joint for joint, f in zip(joints, self._followed, strict=True) if f and joint.name in moved}
        self.inputs = tuple(name for name in named if name in needed)
        self._others = {f.joint for f in self._followed if f} - needed
        # The root link has a joint too, which does not move. Angles are unwrapped here because of mimic joints.
        of_children = (
            Joint.of("revolute" if joint.turns else joint.kind, self._numbers[joint.parent], joint.origin, joint.axis)
            for joint in joints
        )
        self.chain = Chain((Joint.of("fixed", -1, IDENTITY), *of_children))
        # After the joints that move the base, if it moves.
        self._behind = tuple(
            Joint(joint.kind, joint.parent + _AHEAD, joint.origin, joint.axis) for joint in self.chain.joints[1:]
        )

    def number(self, link: str) -> int:
        return self._numbers[link]

    def state(self, positions: Mapping[str, float], base: Rigid = IDENTITY) -> "RobotState":
        """positions: a finite value for each of `inputs`, radians or metres; unknown names are ignored. base:
        transforms coordinates of the root link to those of the scene. Raises RobotError naming missing joints."""
        if missing := [name for name in self.inputs if name not in positions]:
            raise RobotError(f"positions: none for {listed(missing)}; each joint that moves and mimics none needs one")
        inputs = {name: float(positions[name]) for name in self.inputs}
        inputs |= {name: float(positions.get(name, 0.0)) for name in self._others}
        values = [0.0] + [0.0 if f is None else f.factor * inputs[f.joint] + f.offset for f in self._followed]
        if wrong := [
            name for name, value in zip(self._names, values[1:], strict=True) if not abs(value) <= LARGEST_VALUE
        ]:
            raise RobotError(f"positions: not finite, or beyond {LARGEST_VALUE:g}, for {listed(wrong)}")
        return RobotState(self, inputs, np.array(values), base)

    def step(self, start: "RobotState", end: "RobotState") -> "RobotStep":
        """start, end: both of this robot."""
        ends = end.values.copy()
        for number, followed in enumerate(self._followed, 1):
            if followed is not None and followed.joint in self.continuous:
                change = math.remainder(end.inputs[followed.joint] - start.inputs[followed.joint], 2 * math.pi)
                ends[number] = start.values[number] + followed.factor * change
        if _same(start.base, end.base):
            # The poses of both states are used again, unless a joint reaches one by another value.
            known = {0.0: start.pose_rows}
            reached = np.array_equal(ends, end.values)
            if reached:
                known[1.0] = end.pose_rows
            return RobotStep(self, JointStep(self.chain, start.values, ends, start.base, known), 0, reached)
        ahead, goal = _base_joints(start.base, end.base)
        root = Joint.of("fixed", 1, Rigid(start.base.quaternion, np.zeros(3)))
        joints = Chain((*ahead, root, *self._behind))
        return RobotStep(self, JointStep(joints, (0.0, 0.0, *start.values), (*goal, *ends)), _AHEAD)


@dataclass(frozen=True, eq=False)
class RobotState:
    """Joint values at one time. ``inputs``: of the joints that move and mimic no other; ``values``: of the joint of
    each link, from the root on."""

    kinematics: Kinematics
    inputs: dict[str, float]
    values: np.ndarray
    base: Rigid

    @cached_property
    def pose_rows(self) -> np.ndarray:
        """(links,7) float64: quaternion x y z w and shift of each."""
        return self.kinematics.chain.poses(self.values + 0.0, self.base)  # -0.0 is 0.0, as during a step

    @cached_property
    def poses(self) -> dict[str, Rigid]:
        """For each link: transforms its coordinates to those of the scene."""
        return dict(zip(self.kinematics.links, as_rigid(self.pose_rows), strict=True))


@dataclass(frozen=True, eq=False)
class RobotStep:
    """All links between two states; poses are shared by the motions of all of them."""

    kinematics: Kinematics
    joints: JointStep
    ahead: int  # joints that move the base
    of_states: bool = False  # poses at both ends are bit-identical to those of the states

    def poses(self, t: float) -> dict[str, Rigid]:
        """At the fraction t in [0, 1]."""
        return dict(zip(self.kinematics.links, self.joints.poses(t)[self.ahead :], strict=True))

    def motion(self, link: str, body: Body, ends: tuple[np.ndarray, np.ndarray] | None = None) -> LinkMotion:
        """body: geometry in the link's frame. ends: its vertices in both states."""
        number = self.ahead + self.kinematics.number(link)
        return LinkMotion(self.joints, number, body, ends if self.of_states else None)


def _moved_by(joints: Sequence[RobotJoint], links: Iterable[str]) -> set[str]:
    """Names of the joints between the root and one of these links."""
    above = {joint.child: joint for joint in joints}
    found: set[str] = set()
    for link in links:
        while (joint := above.get(link)) is not None and joint.name not in found:
            found.add(joint.name)
            link = joint.parent
    return found


def _followed(joint: RobotJoint, named: Mapping[str, RobotJoint]) -> _Followed:
    factor, offset = 1.0, 0.0
    while joint.mimic is not None:
        factor, offset = factor * joint.mimic.multiplier, offset + factor * joint.mimic.offset
        joint = named[joint.mimic.joint]
    return _Followed(joint.name, factor, offset)


def _same(a: Rigid, b: Rigid) -> bool:
    return np.array_equal(a.shift, b.shift) and np.array_equal(a.quaternion, b.quaternion)


def _base_joints(start: Rigid, end: Rigid) -> tuple[tuple[Joint, Joint], tuple[float, float]]:
    """A prismatic and a revolute joint, 0 at the start, and their values at the end."""
    origin = Rigid(IDENTITY.quaternion, start.shift)
    way = end.shift - start.shift
    far = rounding.length(way)
    if far > 1e-100:
        slide, distance = Joint.of("prismatic", -1, origin, (way / far).tolist()), math.sqrt(dot(way, way))
    else:
        slide, distance = Joint.of("fixed", -1, origin), 0.0
    screw = Screw.between(start, end)
    if not screw.half:
        return (slide, Joint.of("fixed", 0, IDENTITY)), (distance, 0.0)
    return (slide, Joint.of("revolute", 0, IDENTITY, screw.axis.tolist())), (distance, screw.angle)
