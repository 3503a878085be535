# SPDX-License-Identifier: Apache-2.0
"""Notice joint states that move nothing, as their stamp stands still or they name no joint of a robot, and positions
outside the limits of a description, which are often in another unit. No ROS."""

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

from hpccd_ros.base.quoting import counted, listed, shortened, suggestion
from hpccd_ros.node.silence import Silence
from hpccd_ros.robots.urdf import RobotJoint

# Messages of which none is of use, before it is worth a warning.
_LEAST = 3
# Part of the width of a joint's limits by which a position is outside before it is reported: a calibrated encoder
# reads a little beyond its stop.
_BEYOND = 0.01
# Part of that width by which it is outside before its unit is doubted: a little beyond the limits, each angle would be
# valid as one in degrees.
_FAR = 0.5
# s for which a joint stays reported: a gripper in millimetres is within limits in metres whenever it is closed.
_STAYS = 5.0
# Joints outside their limits that are reported at a time.
_MOST = 3


class JointStateWatch:
    """Of the topic ``topic``; `receive` is called for each message, `warnings` about once a second."""

    def __init__(self, topic: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._topic = topic
        self._received = 0
        self._stamp = -1
        self._advanced = _Useful(clock)
        self._silence = Silence(clock)
        self._clock = clock
        self._names: Sequence[str] = ()
        self._robots: list[tuple[set[str], _Useful]] = []  # joints of each, and the messages that name one
        self._limits: dict[str, list[_Limits]] = {}  # by joint; robots may share names
        self._outside: dict[str, _Outside] = {}

    def use(self, robots: Iterable[Mapping[str, RobotJoint]]) -> None:
        """robots: name -> joint, of each robot that this topic moves and that is known."""
        self._robots, self._limits, self._outside = [], {}, {}
        for joints in robots:
            self._robots.append((set(joints), _Useful(self._clock, self._received)))
            for name, joint in joints.items():
                low, high = joint.limits or (0.0, 0.0)
                if low < high:  # <limit effort="1" velocity="1"/> has both at 0
                    self._limits.setdefault(name, []).append(_Limits(low, high, joint.turns))

    def receive(self, stamp: int, names: Sequence[str], positions: Sequence[float] = ()) -> None:
        self._received += 1
        if stamp > self._stamp or stamp < self._stamp - 10**9:  # a clock that is set back advances from there
            self._advanced.at(self._received)
            self._stamp = stamp
        self._names = names
        for joints, named in self._robots:
            if not joints or not joints.isdisjoint(names):
                named.at(self._received)
        for name, position in zip(names, positions, strict=False):
            for limits in self._limits.get(name, ()):
                if math.isfinite(position) and limits.beyond(position) > _BEYOND:
                    self._outside[name] = _Outside(position, limits, self._clock())
                    break
            else:
                if name in self._outside and self._clock() - self._outside[name].at >= _STAYS:
                    del self._outside[name]

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
        if unnamed := [joints for joints, named in self._robots if named.lacking(self._received)]:
            joints, names = sorted(set().union(*unnamed)), list(self._names)
            near = next((found for name in names if (found := suggestion(name, joints))), "")
            lines.append(
                f"{self._topic}: no message names a joint of the robot ({listed(joints)}); the last one names "
                f"{listed(map(shortened, names)) or 'none'}; use the names of its description{near}"
            )
        lines += [
            f"{self._topic}: joint {shortened(name)} {outside}" for name, outside in [*self._outside.items()][:_MOST]
        ]
        if (more := len(self._outside) - _MOST) > 0:
            lines.append(f"{self._topic}: {counted(more, 'more joint')} outside the limits of the description")
        return lines


class _Limits(NamedTuple):
    """Of a joint; ``turns``: in radians, not metres."""

    low: float
    high: float
    turns: bool

    def beyond(self, position: float) -> float:
        """How far it is outside, as a fraction of the width."""
        return max(self.low - position, position - self.high) / (self.high - self.low)


class _Outside(NamedTuple):
    """The last ``position`` of a joint outside its ``limits``, and when it was received."""

    position: float
    limits: _Limits
    at: float

    def __str__(self) -> str:
        low, high, turns = self.limits
        unit, name, other, factor = (
            ("rad", "radians", "degrees", math.pi / 180) if turns else ("m", "metres", "millimetres", 1e-3)
        )
        far = self.limits.beyond(self.position) > _FAR and self.limits.beyond(self.position * factor) <= _BEYOND
        remedy = f"send {name} (this looks like {other})" if far else "correct the position or the limits"
        return f"is at {self.position:g} {unit}, outside its limits {low:g} .. {high:g} in the description; {remedy}"


class _Useful:
    """Whether useful messages have stopped while others go on."""

    def __init__(self, clock: Callable[[], float], received: int = 0) -> None:
        """received: messages that came before."""
        self._silence = Silence(clock)
        self._count = 0
        self._last = received

    def at(self, number: int) -> None:
        """The message with this number, from 1 on, was useful."""
        self._count += 1
        self._last = number

    def lacking(self, received: int) -> bool:
        return self._silence.lasts(self._count) and received - self._last >= _LEAST
