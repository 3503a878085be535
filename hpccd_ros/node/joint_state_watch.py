# SPDX-License-Identifier: Apache-2.0
"""Notice joint states that move nothing, as their stamp stands still or they name no joint of a robot, and positions
outside the limits of a description, which are often in another unit. No ROS."""

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence

from hpccd_ros.base.quoting import counted, listed, shortened, suggestion
from hpccd_ros.node.silence import Silence
from hpccd_ros.robots.urdf import RobotJoint

# Messages of which none is of use, before it is worth a warning.
_LEAST = 3
# Of the width of a joint's limits, by which a position is outside before it is reported: a calibrated encoder reads a
# little beyond its stop.
_BEYOND = 0.01
# Joints outside their limits that are reported at a time.
_MOST = 3


class JointStateWatch:
    """Of the topic ``topic``; `receive` is called for each message, `warnings` about once a second."""

    def __init__(self, topic: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._topic = topic
        self._received = 0
        self._stamp = -1
        self._advanced = _Useful(clock)
        self._named = _Useful(clock)
        self._silence = Silence(clock)
        self._names: Sequence[str] = ()
        self._joints: Mapping[str, RobotJoint] = {}
        self._allowed: dict[str, tuple[float, float]] = {}
        self._outside: dict[str, float] = {}  # joint -> its last position

    def use(self, robots: Iterable[Mapping[str, RobotJoint]]) -> None:
        """robots: name -> joint, of each robot that this topic moves and that is known."""
        self._joints = {name: joint for joints in robots for name, joint in joints.items()}
        self._allowed, self._outside = {}, {}
        for name, joint in self._joints.items():
            low, high = joint.limits or (0.0, 0.0)
            if low < high:  # <limit effort="1" velocity="1"/> has both at 0
                margin = _BEYOND * (high - low)
                self._allowed[name] = low - margin, high + margin

    def receive(self, stamp: int, names: Sequence[str], positions: Sequence[float] = ()) -> None:
        self._received += 1
        if stamp > self._stamp or stamp < self._stamp - 10**9:  # a clock that is set back advances from there
            self._advanced.at(self._received)
            self._stamp = stamp
        if not self._joints or not self._joints.keys().isdisjoint(names):
            self._named.at(self._received)
        else:
            self._names = names
        for name, position in zip(names, positions, strict=False):
            if (allowed := self._allowed.get(name)) is None:
                continue
            if position < allowed[0] or position > allowed[1]:
                self._outside[name] = position
            elif self._outside:
                self._outside.pop(name, None)

    def silent(self, publishers: int) -> bool:
        """Whether no message has come for a while from this number of publishers."""
        return self._silence.lasts((self._received, publishers))

    def warnings(self) -> list[str]:
        """Each with its remedy."""
        lines = []
        if self._advanced.lacking(self._received):
            if self._stamp == 0:
                problem, remedy = "header.stamp is 0 in every message", "let the publisher set it to the current time"
            else:
                problem = f"header.stamp stays at {self._stamp} ns in all messages"
                remedy = "let the publisher set it to the time of the positions"
            lines.append(f"{self._topic}: {problem}, so the robot does not move; {remedy}")
        if self._named.lacking(self._received):
            joints, names = sorted(self._joints), list(self._names)
            near = next((found for name in names if (found := suggestion(name, joints))), "")
            lines.append(
                f"{self._topic}: no message names a joint of the robot ({listed(joints)}); the last one names "
                f"{listed(map(shortened, names)) or 'none'}; use the names of its description{near}"
            )
        outside = list(self._outside.items())
        lines += [self._beyond_limits(name, position) for name, position in outside[:_MOST]]
        if (more := len(outside) - _MOST) > 0:
            lines.append(f"{self._topic}: {counted(more, 'more joint')} outside the limits of the description")
        return lines

    def _beyond_limits(self, name: str, position: float) -> str:
        joint = self._joints[name]
        (low, high), (least, most) = joint.limits or (0.0, 0.0), self._allowed[name]
        unit, other, factor = ("rad", "degrees", math.pi / 180) if joint.turns else ("m", "millimetres", 1e-3)
        remedy = "send another position, or correct the limits"
        if least <= position * factor <= most:
            remedy = f"positions are in {unit}, and this one may be in {other}"
        return (
            f"{self._topic}: joint {shortened(name)} is at {position:g} {unit}, outside its limits {low:g} .. {high:g} "
            f"in the description; {remedy}"
        )


class _Useful:
    """Whether useful messages have stopped while others go on."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._silence = Silence(clock)
        self._count = 0
        self._last = 0

    def at(self, number: int) -> None:
        """The message with this number, from 1 on, was useful."""
        self._count += 1
        self._last = number

    def lacking(self, received: int) -> bool:
        return self._silence.lasts(self._count) and received - self._last >= _LEAST
