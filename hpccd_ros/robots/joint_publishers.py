# SPDX-License-Identifier: Apache-2.0
"""Several publishers of joint states of one robot: which one sent a message, and whether two contradict each other.

Several publishers may share a robot, each with its own joints. Two publishers of the same joint must agree: otherwise
at most one of them has its position.
"""

import math
from bisect import bisect_left
from collections import deque
from collections.abc import Callable, Collection, Iterable

from hpccd_ros.base.quoting import quoted
from hpccd_ros.frames.samples import HISTORY_NS

# Limits on memory that untrusted publishers can use: publishers of a topic, and values of a joint for each.
MOST_PUBLISHERS = 8
MOST_VALUES = 32
# Relative difference between two values that rounding to single precision can make.
TOLERANCE = 1e-6


class PublisherNumbers:
    """Distinguishes the publishers of a topic by the sequence numbers of their messages, the only information from DDS.
    A message belongs to the publisher with the closest number below its own."""

    def __init__(self) -> None:
        self._last: list[int] = []  # of each publisher
        self._current = 0  # the publisher of the last message

    def of(self, number: int, several: Callable[[], bool]) -> int | None:
        """The number of the publisher, from 0; None: there is only one. several: whether there are several, called if
        the numbers are not consecutive."""
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
    """The last values of each joint from each publisher. continuous: joints whose values are angles modulo 2 pi.

    Two publishers agree on a joint if a value of one lies between the other's values before and after it, or beyond
    them by no more than their difference: a joint may turn back between two messages. Two publishers contradict each
    other until they agree again, or one has been silent for HISTORY_NS.
    """

    def __init__(self, continuous: Collection[str]) -> None:
        self._continuous = continuous
        self._values: dict[str, dict[int, deque[tuple[int, float]]]] = {}
        self._contradicting: set[tuple[str, frozenset[int]]] = set()

    def contradiction(self, publisher: int, stamp: int, joints: Iterable[tuple[str, float]]) -> str:
        """How a message contradicts another publisher; "": it does not."""
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
                        f"two publishers contradict each other on joint {quoted(name)}, one sent {value:.6g} for "
                        f"{stamp} ns; use one publisher for each joint"
                    )
        return found

    def _compared(
        self, name: str, before: tuple[int, float] | None, at: tuple[int, float], theirs: deque[tuple[int, float]]
    ) -> list[bool]:
        """Whether two publishers agree, for each value that can be compared."""
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
