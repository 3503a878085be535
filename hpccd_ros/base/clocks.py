# SPDX-License-Identifier: Apache-2.0
"""How old a message is: the system clock, by which it was sent, watched by the steady clock, which nobody sets."""

import time
from collections.abc import Callable
from dataclasses import dataclass

#: Seconds by which the clocks of two machines of one system may differ (NTP, PTP).
CLOCK_ERROR = 0.02
# Seconds a second by which the system clock may be slewed: the kernel's limit is 500 ppm, a crystal is off by 100.
_SLEW = 1e-3
# Seconds by which what was sent before a clock was set back may have waited and still be taken.
_LONGEST_WAIT = 10.0


@dataclass(frozen=True)
class Clocks:
    """``steady``: seconds since any time. ``system``: ns since the epoch, as DDS stamps what is sent."""

    steady: Callable[[], float] = lambda: time.monotonic()
    system: Callable[[], int] = lambda: time.time_ns()


class ClockWatch:
    """Whether the ages of messages can be trusted. They cannot after a jump of the system clock against the steady one,
    or a message from the future, by more than ``error`` s in either case, until both have agreed for ``wait`` s.

    What was sent by a clock that is set back afterwards seems younger than it is, by as much. So the wait is longer by
    that, up to 10 s: then it seems older than ``wait`` at last. Nothing that came in the meantime counts later. Not for
    several threads at once.
    """

    def __init__(self, error: float, wait: float) -> None:
        self._error = error
        self._wait = wait
        self._offset: float | None = None  # of the system clock to the steady one, s
        self._steady = 0.0  # when it was
        self._until = -float("inf")
        self._text = ""

    def look(self, steady: float, system: int) -> None:
        """Compare the two; to be called several times in each ``wait``."""
        offset = 1e-9 * system - steady
        if self._offset is None:
            self._offset = offset
        jump, slew = offset - self._offset, _SLEW * (steady - self._steady)
        if abs(jump) > self._error + slew:
            self._doubt(steady, max(-jump, 0.0), f"the system clock jumped by {jump:+.3g} s against the steady clock")
            self._offset = offset
        else:
            self._offset += min(max(jump, -slew), slew)
        self._steady = steady

    def hear(self, what: str, ahead: float, steady: float) -> bool:
        """``what``, sent ``ahead`` s after now. Whether it is from the future."""
        if ahead <= self._error:
            return False
        text = f"{what} was sent {ahead:.3g} s in the future; synchronise the clocks (NTP, PTP)"
        self._doubt(steady, ahead, text)
        return True

    def why(self, steady: float) -> str:
        """Why ages cannot be trusted, in words; "": they can."""
        return self._text if steady < self._until else ""

    def _doubt(self, steady: float, younger: float, text: str) -> None:
        until = steady + self._wait + min(younger, _LONGEST_WAIT)
        self._until, self._text = max(self._until, until), text
