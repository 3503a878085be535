# SPDX-License-Identifier: Apache-2.0
"""Log refused messages without flooding the log: a publisher in error repeats it at its full rate."""

import time
from collections.abc import Callable

from hpccd_ros.base.quoting import shortened
from hpccd_ros.frames.drops import Reason

# Texts quote what publishers sent (frame names, field names), which may be of any length.
_LONGEST = 500


class RefusalLog:
    """Hands on the first text of each (mesh, reason), then one every ``period`` s."""

    def __init__(
        self, warn: Callable[[str], None], period: float = 10.0, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._warn = warn
        self._period = period
        self._clock = clock
        self._silent: dict[tuple[str, Reason], tuple[float, int]] = {}
        self.last = ""

    def __call__(self, mesh: str, reason: Reason, text: str) -> None:
        self.last = f"{mesh}: {reason}: {shortened(text, _LONGEST)}"
        now = self._clock()
        since, count = self._silent.get((mesh, reason), (-float("inf"), 0))
        if now - since < self._period:
            self._silent[mesh, reason] = since, count + 1
            return
        self._silent[mesh, reason] = now, 0
        self._warn(self.last + (f" ({count} more of these in between)" if count else ""))
