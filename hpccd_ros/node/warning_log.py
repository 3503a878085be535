# SPDX-License-Identifier: Apache-2.0
"""The warnings of /diagnostics in the log: each cause once, until it has been gone for a while. No ROS."""

import re
import time
from collections.abc import Callable, Iterable

# s for which a cause must last: others come up while nodes start, or between two frames.
LASTS = 2.0
# s without a cause, after which it is logged again if it comes back.
GONE = 10.0
# Stamps and counts, by which two texts of one cause differ, as they do by the remedy; numbers within names stay.
_NUMBER = re.compile(r"(?<![\w/])-?\d[\d.,]*(e[+-]\d+)?(?!\w)")


class WarningLog:
    """warn: logs a text."""

    def __init__(self, warn: Callable[[str], None], clock: Callable[[], float] = time.monotonic) -> None:
        self._warn = warn
        self._clock = clock
        self._first: dict[str, float] = {}
        self._last: dict[str, float] = {}
        self._logged: set[str] = set()

    def tell(self, new: Iterable[str], lasting: Iterable[str] = ()) -> None:
        """The warnings of now; to be called about once a second. lasting: have lasted, and are logged at once."""
        now = self._clock()
        for lines, least in ((new, LASTS), (lasting, 0.0)):
            for text in lines:
                cause = _NUMBER.sub("#", text.partition("; ")[0])
                self._last[cause] = now
                if now - self._first.setdefault(cause, now) >= least and cause not in self._logged:
                    self._logged.add(cause)
                    self._warn(text)
        for cause in [
            cause for cause, last in self._last.items() if now - last > (GONE if cause in self._logged else 0)
        ]:
            del self._last[cause], self._first[cause]
            self._logged.discard(cause)
