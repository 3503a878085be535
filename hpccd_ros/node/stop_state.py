# SPDX-License-Identifier: Apache-2.0
"""Whether to stop, and why: what is known of the steps so far, and how old it is. No ROS.

All times are those of time.monotonic(): no jump of the system's time, no pause of /clock moves them.
"""

import threading
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

# Of the time-out: said so much earlier, a silence is heard of within it.
IN_TIME = 0.95


class Cause(StrEnum):
    """Why stop is true."""

    INACTIVE = "inactive"  # the node does not detect
    UNANSWERED = "unanswered"  # no step was answered yet
    NEAR = "near"
    REFUSED = "refused"  # a message that is wrong
    FAILED = "failed"  # a detection
    SILENT = "silent"  # no answer that is fresh


@dataclass(frozen=True)
class Why:
    """text: a sentence without its full stop."""

    cause: Cause
    text: str


class StopState:
    """Told by the threads that know something; read by the one that publishes, which waits in `next`.

    distance: that asked for; an answer for a smaller one does not count. timeout: s within which it is to be heard that
    an answer holds no more, from the arrival of the frame that its step ends with. busy: whether a frame is worked on.
    rises: how often stop became true, by cause.
    """

    def __init__(self, distance: float, timeout: float, busy: Callable[[], bool] = lambda: False) -> None:
        self.distance = distance
        self._timeout = IN_TIME * timeout
        self._busy = busy
        self._condition = threading.Condition()
        self._active = self._closed = False
        self._why: Why | None = Why(Cause.INACTIVE, "the node is not active")
        self._unsaid: Why | None = None
        self._said: Why | None = None
        self._fresh = self._doubted = 0.0  # arrival of the frame that was last found clear; when one was refused
        self.rises: Counter[Cause] = Counter()

    def begin(self) -> None:
        """Steps will be answered from now on."""
        self._tell(Cause.UNANSWERED, "no step was answered since the node was activated", active=True)

    def end(self, text: str = "the node is not active") -> None:
        """What is answered from now on no longer counts."""
        self._tell(Cause.INACTIVE, text, active=False)

    def close(self) -> None:
        """For good: `next` returns at once, with a reason."""
        self.end("the node has ended")
        with self._condition:
            self._closed = True
            self._condition.notify_all()

    @property
    def closed(self) -> bool:
        return self._closed

    def first(self) -> None:
        """A frame came that ends no step: nothing is known of the motion to it."""
        self._tell(Cause.UNANSWERED, "no step was answered since the stream, or a topology, began anew")

    def answered(self, near: bool, distance: float, received: float) -> None:
        """A step, asked for this distance; received: the arrival of the frame that it ends with."""
        if near:
            self._tell(Cause.NEAR, f"meshes came within {distance:g} of each other on the last step, or touched")
            return
        with self._condition:
            if not self._active or received <= self._doubted or distance < self.distance:
                return
            self._fresh, self._why = received, None
            self._condition.notify_all()

    def changed(self, distance: float) -> None:
        """Another distance is asked for from now on."""
        larger, self.distance = distance > self.distance, distance
        if larger:
            self._tell(Cause.UNANSWERED, f"no step was answered since stop_distance became {distance:g}")

    def refused(self, text: str) -> None:
        """A message was wrong: what came before it tells nothing of now."""
        self._tell(Cause.REFUSED, text, doubt=True)

    def failed(self, text: str) -> None:
        """A step was not answered."""
        self._tell(Cause.FAILED, text, doubt=True)

    def why(self) -> Why | None:
        """As it is now; None: no reason to stop."""
        with self._condition:
            return self._now(time.monotonic())

    def next(self, until: float) -> Why | None:
        """What to say: waits for something else than what was said last, until that time at most. Each rise is said,
        however short."""
        with self._condition:
            while True:
                now = time.monotonic()
                why = self._unsaid or self._now(now)
                if self._unsaid or (why is None) != (self._said is None) or now >= until or self._closed:
                    break
                wake = until if why is not None else min(until, self._fresh + self._timeout)
                self._condition.wait(wake - now)
            if why is not None and self._said is None:
                self.rises[why.cause] += 1
            self._unsaid, self._said = None, why
            return why

    def _now(self, now: float) -> Why | None:
        if self._why is not None or now - self._fresh < self._timeout:
            return self._why
        since = "a later one is worked on" if self._busy() else "no later one has"
        return Why(Cause.SILENT, f"the last frame that was found clear came {now - self._fresh:.3g} s ago, {since}")

    def _tell(self, cause: Cause, text: str, *, active: bool | None = None, doubt: bool = False) -> None:
        with self._condition:
            if active is not None:
                self._active = active
            elif not self._active:
                return
            if doubt:
                self._doubted = time.monotonic()
            why = Why(cause, text)
            if self._why is None:
                self._unsaid = why
            self._why = why
            self._condition.notify_all()
