# SPDX-License-Identifier: Apache-2.0
"""How long frames have waited without any of them going on.

Between a frame and what places it lies some time in any stream: that one waits just now says nothing. No ROS.
"""

import time

# s without a frame that goes on, from which on it is worth a warning.
LONG = 0.5


class Standstill:
    def __init__(self) -> None:
        self._since: float | None = None

    def waits(self) -> None:
        """A frame waits, maybe beside others."""
        if self._since is None:
            self._since = time.monotonic()

    def ends(self) -> None:
        """A frame went on, or none waits any more."""
        self._since = None

    @property
    def long(self) -> bool:
        return self._since is not None and time.monotonic() - self._since >= LONG
