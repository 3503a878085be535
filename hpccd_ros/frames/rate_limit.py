# SPDX-License-Identifier: Apache-2.0
"""A bound on how often something may happen. No ROS."""

import time
from collections.abc import Callable


class RateLimit:
    """Token bucket: ``rate`` a second as a mean, bursts of one second's worth (at least one). 0: no limit."""

    def __init__(self, rate: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._rate = rate
        self._most = max(1.0, rate)
        self._clock = clock
        self._tokens = self._most
        self._filled = clock()

    def allows(self) -> bool:
        """True where one more is within the limit; it is then counted."""
        if self._rate == 0.0:
            return True
        now = self._clock()
        self._tokens = min(self._most, self._tokens + self._rate * (now - self._filled))
        self._filled = now
        if self._tokens < 1.0:
            return False
        self._tokens -= 1.0
        return True
