# SPDX-License-Identifier: Apache-2.0
"""How long frames have waited without any of them continuing. No ROS.

In any stream some time passes between a frame and the message that places it, so a single waiting frame is normal.
"""

import time

# Seconds without a frame that continues, after which there is a warning.
LONG = 0.5


class Standstill:
    def __init__(self) -> None:
        self._since: float | None = None

    def waits(self) -> None:
        """A frame waits, maybe with others."""
        if self._since is None:
            self._since = time.monotonic()

    def ends(self) -> None:
        """A frame continued, or none waits any more."""
        self._since = None

    @property
    def long(self) -> bool:
        return self._since is not None and time.monotonic() - self._since >= LONG
