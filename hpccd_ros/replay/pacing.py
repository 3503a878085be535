# SPDX-License-Identifier: Apache-2.0
"""The pace at which a recording is played or replayed: at a rate, or one frame at each Enter."""

import time


def next_wanted(where: str) -> bool:
    """Wait for Enter; False at the end of the input (Ctrl-D)."""
    try:
        input(f"{where}: Enter continues with the next frame, Ctrl-D ends ")
    except EOFError:
        return False
    return True


class Pace:
    """rate: speed, 1: as recorded, 0: without pauses. stop: becomes true when it should no longer wait."""

    def __init__(self, rate: float, stop=()):
        self._rate, self._stop = rate, stop
        self._began = self._first = None

    def wait(self, at: float) -> None:
        """Return when the message recorded at `at` seconds is due; at once for the first."""
        if not self._rate:
            return
        if self._began is None:
            self._began, self._first = time.monotonic(), at
        until = self._began + (at - self._first) / self._rate
        while not self._stop and (left := until - time.monotonic()) > 0:
            time.sleep(min(left, 0.1))

    def delay(self, seconds: float) -> None:
        """Delay all later messages by this."""
        if self._began is not None:
            self._began += seconds
