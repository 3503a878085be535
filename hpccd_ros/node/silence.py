# SPDX-License-Identifier: Apache-2.0
"""Whether messages have stopped coming. No ROS."""

import time
from collections.abc import Callable

# s without a message, from which on an input is silent.
QUIET = 3.0


class Silence:
    """Begins when it is made. Looks at a count now and then, so that a message costs no look at the clock."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._count = 0
        self._since = clock()

    def lasts(self, count: int) -> bool:
        """Whether ``count`` has stood still for QUIET s."""
        now = self._clock()
        if count != self._count:
            self._count, self._since = count, now
        return now - self._since >= QUIET
