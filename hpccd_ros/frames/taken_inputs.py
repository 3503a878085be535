# SPDX-License-Identifier: Apache-2.0
"""What a node has taken, in order: what the frames that it makes depend on. No ROS.

Topics are received independently of each other: which message of one came before which of another only the receiver
knows. Each answer therefore lists what was taken since the answer before (ContactArray.input_topic), and a replay
follows that order.
"""

import threading
from collections import deque
from typing import NamedTuple

# Flags of an input.
NEW_PUBLISHER, SEVERAL_PUBLISHERS = 1, 2

# Events beside the messages of topics: no topic's name begins like that.
EVENT = "!"
STOPPED = f"{EVENT}stopped"
RESTART_AFTER = f"{EVENT}restart_after"  # sent: the value
_ROBOTS = f"{EVENT}robots"

# Kept until the next answer, which may never come: half a minute of ten topics at 60 Hz, 2 MB.
MOST_UNTOLD = 20_000


class TakenInput(NamedTuple):
    """``number``: from 1. ``topic``: relative, before remapping; or an event. ``sent``: by its publisher, ns."""

    number: int
    topic: str
    sent: int
    flags: int = 0


def robots_known(names: list[str]) -> str:
    """The event that these robots are known from now on, and no other."""
    return " ".join([_ROBOTS, *names])


def known_robots(event: str) -> list[str] | None:
    """The names in such an event; None: it is another one."""
    first, *names = event.split(" ")
    return names if first == _ROBOTS else None


class TakenInputs:
    """``count``: of the inputs taken so far. Added to by one thread, told by another."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self.restart()

    def restart(self) -> None:
        """Nothing has been taken."""
        self.count = 0
        self._untold: deque[TakenInput] = deque(maxlen=MOST_UNTOLD)

    def add(self, topic: str, sent: int, flags: int = 0) -> None:
        with self._lock:
            self.count += 1
            self._untold.append(TakenInput(self.count, topic, sent, flags))

    def tell(self, last: int) -> list[TakenInput]:
        """Those up to the number ``last`` that were not told before, without gaps."""
        told = []
        with self._lock:
            while self._untold and self._untold[0].number <= last:
                told.append(self._untold.popleft())
        return told
