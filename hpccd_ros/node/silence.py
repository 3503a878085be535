# SPDX-License-Identifier: Apache-2.0
"""Whether messages have stopped coming. No ROS."""

import time
from collections.abc import Callable, Hashable

# s without a message, from which on an input is silent.
QUIET = 3.0


class Silence:
    """Begins at the first look. Looks at a count now and then, so that a message costs no look at the clock."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._count: Hashable = None
        self._since = clock()

    def lasts(self, count: Hashable) -> bool:
        """Whether ``count``, of messages and whatever else begins a new silence, has stood still for QUIET s."""
        now = self._clock()
        if count != self._count:
            self._count, self._since = count, now
        return now - self._since >= QUIET
