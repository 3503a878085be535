# SPDX-License-Identifier: Apache-2.0
"""Several publishers of joint states of one robot: who sent a message, and whether two of them contradict each other.

Several may share a robot, each with joints of its own. Two that tell of the same joint must agree: at most one of them
says where it is.
"""

import math
from bisect import bisect_left
from collections import deque
from collections.abc import Callable, Collection, Iterable

from hpccd_ros.base.quoting import quoted
from hpccd_ros.frames.samples import HISTORY_NS

# Bound what strangers can make the node keep: publishers of a topic, and values of a joint of each.
MOST_PUBLISHERS = 8
MOST_VALUES = 32
# Of a value: what rounding to single precision on the way makes of it.
TOLERANCE = 1e-6


class PublisherNumbers:
    """Tells the publishers of one topic apart by the numbers that they count their messages with: DDS tells the node no
    more. Each message goes on from the closest number below its own."""

    def __init__(self) -> None:
        self._last: list[int] = []  # of each publisher
        self._current = 0  # that of the last message

    def of(self, number: int, several: Callable[[], bool]) -> int | None:
        """Which publisher it is, from 0 on; None: there is one. several: whether there are, asked where the numbers do
        not go on as those of one."""
        if self._last and number == self._last[self._current] + 1:
            self._last[self._current] = number
            return self._current if len(self._last) > 1 else None
        below = [place for place, last in enumerate(self._last) if last < number]
        if below and len(self._last) > 1:
            self._current = max(below, key=lambda place: self._last[place])
        elif not self._last or not several():
            self._last, self._current = [], 0
        else:
            self._current = len(self._last) % MOST_PUBLISHERS
        self._last[self._current : self._current + 1] = [number]
        return self._current if len(self._last) > 1 else None


class JointPublishers:
    """What each of several publishers said last of each joint. continuous: joints whose values are angles modulo 2 pi.

    Two agree on a joint where a value of one lies between those of the other before and after it, or beyond them by no
    more than these differ: joints turn back between two messages. Two that contradict each other do so until they are
    found to agree, or one has been silent for HISTORY_NS.
    """

    def __init__(self, continuous: Collection[str]) -> None:
        self._continuous = continuous
        self._values: dict[str, dict[int, deque[tuple[int, float]]]] = {}
        self._contradicting: set[tuple[str, frozenset[int]]] = set()

    def contradiction(self, publisher: int, stamp: int, joints: Iterable[tuple[str, float]]) -> str:
        """How a message contradicts another publisher, in words; "": it does not."""
        found = ""
        for name, value in joints:
            of_joint = self._values.setdefault(name, {})
            ours = of_joint.setdefault(publisher, deque(maxlen=MOST_VALUES))
            if ours and stamp <= ours[-1][0]:
                ours.clear()  # its time went back
            before = ours[-1] if ours else None
            ours.append((stamp, value))
            for other in [other for other in of_joint if other != publisher]:
                pair = name, frozenset((publisher, other))
                if of_joint[other][-1][0] < stamp - HISTORY_NS:
                    del of_joint[other]
                    self._contradicting.discard(pair)
                elif compared := self._compared(name, before, ours[-1], of_joint[other]):
                    (self._contradicting.discard if all(compared) else self._contradicting.add)(pair)
                if pair in self._contradicting:
                    found = found or (
                        f"two publishers contradict each other on joint {quoted(name)}, one says {value:.6g} at "
                        f"{stamp} ns; let one publisher tell of each joint"
                    )
        return found

    def _compared(
        self, name: str, before: tuple[int, float] | None, at: tuple[int, float], theirs: deque[tuple[int, float]]
    ) -> list[bool]:
        """Whether they agree, once for each value that can be compared."""
        found = []
        place = bisect_left(theirs, at[0], key=lambda item: item[0])
        if place < len(theirs) and (place > 0 or theirs[place][0] == at[0]):
            start = theirs[place] if theirs[place][0] == at[0] else theirs[place - 1]
            found.append(self._between(name, start[1], theirs[place][1], at[1]))
        if before is not None:
            passed = [value for stamp, value in theirs if before[0] < stamp < at[0]]
            found += [self._between(name, before[1], at[1], value) for value in passed]
        return found

    def _between(self, name: str, start: float, end: float, value: float) -> bool:
        change, offset = end - start, value - start
        if name in self._continuous:
            change, offset = math.remainder(change, 2 * math.pi), math.remainder(offset, 2 * math.pi)
        slack = abs(change) + TOLERANCE * max(1.0, abs(start))
        return min(change, 0.0) - slack <= offset <= max(change, 0.0) + slack
