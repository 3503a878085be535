# SPDX-License-Identifier: Apache-2.0
"""Notice joint states that move nothing: their stamp stands still, or they name no joint of a robot. No ROS."""

import time
from collections.abc import Callable, Collection, Iterable, Sequence

from hpccd_ros.base.quoting import listed, shortened, suggestion
from hpccd_ros.node.silence import Silence

# Messages of which none is of use, before it is worth a warning.
_LEAST = 3


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
        self._joints: frozenset[str] = frozenset()

    def use(self, joints: Iterable[Collection[str]]) -> None:
        """joints: those of each robot that this topic moves and that is known."""
        self._joints = frozenset().union(*joints)

    def receive(self, stamp: int, names: Sequence[str]) -> None:
        self._received += 1
        if stamp > self._stamp or stamp < self._stamp - 10**9:  # a clock that is set back advances from there
            self._advanced.at(self._received)
            self._stamp = stamp
        if not self._joints or not self._joints.isdisjoint(names):
            self._named.at(self._received)
        else:
            self._names = names

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
        return lines


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
