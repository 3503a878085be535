# SPDX-License-Identifier: Apache-2.0
"""The messages that a node has taken, in order: its frames depend on them. No ROS.

Topics are received independently of each other: only the receiver knows the order of messages across topics. Each
result therefore lists the messages taken since the previous result (ContactArray.input_topic), and a replay follows
that order.
"""

import threading
from collections import deque
from typing import NamedTuple

# Flags of an input.
NEW_PUBLISHER, SEVERAL_PUBLISHERS = 1, 2

# Prefix of events, which are listed among the messages: no topic name begins with it.
EVENT = "!"
STOPPED = f"{EVENT}stopped"
RESTART_AFTER = f"{EVENT}restart_after"  # sent: the value
_ROBOTS = f"{EVENT}robots"

# Inputs kept until the next result, which may never come: half a minute of ten topics at 60 Hz, 2 MB.
MOST_UNREPORTED = 20_000


class TakenInput(NamedTuple):
    """``number``: from 1. ``topic``: relative name before remapping, or an event. ``sent``: source timestamp, ns."""

    number: int
    topic: str
    sent: int
    flags: int = 0


def robots_known(names: list[str]) -> str:
    """The event that from now on exactly these robots are known."""
    return " ".join([_ROBOTS, *names])


def known_robots(event: str) -> list[str] | None:
    """The names in such an event; None: it is another event."""
    first, *names = event.split(" ")
    return names if first == _ROBOTS else None


class TakenInputs:
    """The inputs taken since the last result. ``count``: of all so far. One thread adds them, another reports them."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self.restart()

    def restart(self) -> None:
        """Forget all: nothing has been taken."""
        self.count = 0
        self._unreported: deque[TakenInput] = deque(maxlen=MOST_UNREPORTED)

    def add(self, topic: str, sent: int, flags: int = 0) -> None:
        with self._lock:
            self.count += 1
            self._unreported.append(TakenInput(self.count, topic, sent, flags))

    def pop_until(self, last: int) -> list[TakenInput]:
        """The inputs up to the number ``last`` that were not reported before, without gaps."""
        reported = []
        with self._lock:
            while self._unreported and self._unreported[0].number <= last:
                reported.append(self._unreported.popleft())
        return reported
