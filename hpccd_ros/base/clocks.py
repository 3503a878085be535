# SPDX-License-Identifier: Apache-2.0
"""Ages of messages from the system clock, checked with the steady clock, which is never set."""

import time
from collections.abc import Callable
from dataclasses import dataclass

#: Seconds by which the clocks of two machines in one system may differ (NTP, PTP).
CLOCK_ERROR = 0.02
# Seconds per second by which the system clock may be slewed: the kernel's limit is 500 ppm, a crystal is off by 100.
_SLEW = 1e-3
# Seconds that a message sent before a clock was set back may wait and still be taken.
_LONGEST_WAIT = 10.0


@dataclass(frozen=True)
class Clocks:
    """``steady``: seconds since an arbitrary time. ``system``: ns since the epoch, as in DDS source timestamps."""

    steady: Callable[[], float] = lambda: time.monotonic()
    system: Callable[[], int] = lambda: time.time_ns()


class ClockWatch:
    """Whether the ages of messages can be trusted. Ages are untrusted after a jump of the system clock relative to the
    steady one, or after a message from the future, by more than ``error`` s, until both clocks have agreed for ``wait``
    s.

    If a clock is set back after it dated a message, the message seems younger by this amount. So the wait is longer by
    this amount, or by the sum of several that follow each other, up to 10 s; then such a message seems older than
    ``wait``. Messages received during the wait never count. Not thread-safe.
    """

    def __init__(self, error: float, wait: float) -> None:
        self._error = error
        self._wait = wait
        self._offset: float | None = None  # system clock minus steady clock, s
        self._steady = 0.0  # when the offset was measured
        self._until = -float("inf")
        self._text = ""

    def look(self, steady: float, system: int) -> None:
        """Compare the two clocks; to be called several times in each ``wait``."""
        offset = 1e-9 * system - steady
        if self._offset is None:
            self._offset = offset
        jump, slew = offset - self._offset, _SLEW * (steady - self._steady)
        if abs(jump) > self._error + slew:
            # A message sent before an earlier jump seems younger by this one too.
            back, rest = max(-jump, 0.0), max(self._until - steady - self._wait, 0.0)
            self._doubt(steady, rest + back, f"the system clock jumped by {jump:+.3g} s against the steady clock")
            self._offset = offset
        else:
            self._offset += min(max(jump, -slew), slew)
        self._steady = steady

    def hear(self, what: str, ahead: float, steady: float) -> bool:
        """Take note of ``what``, which was sent ``ahead`` s after now. Returns whether it is from the future."""
        if ahead <= self._error:
            return False
        text = f"{what} was sent {ahead:.3g} s in the future; synchronise the clocks (NTP, PTP)"
        self._doubt(steady, ahead, text)
        return True

    def why(self, steady: float) -> str:
        """Why ages are untrusted; "" if they are trusted."""
        return self._text if steady < self._until else ""

    def _doubt(self, steady: float, younger: float, text: str) -> None:
        until = steady + self._wait + min(younger, _LONGEST_WAIT)
        self._until, self._text = max(self._until, until), text
