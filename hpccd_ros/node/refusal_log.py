# SPDX-License-Identifier: Apache-2.0
"""Log refused messages without flooding the log: a publisher in error repeats it at its full rate."""

import time
from collections.abc import Callable, Iterable

from hpccd_ros.base.quoting import listed, shortened
from hpccd_ros.frames.drops import Input, Reason, Refusal

# Texts quote what publishers sent (frame names, field names), which may be of any length.
_LONGEST = 500


class RefusalLog:
    """Hands on the first text of each (mesh, reason), then one every ``period`` s. Links of a robot are as one mesh."""

    def __init__(
        self, warn: Callable[[str], None], period: float = 10.0, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._warn = warn
        self._period = period
        self._clock = clock
        self._silent: dict[tuple[str, Reason], tuple[float, int]] = {}
        self.last = ""

    def __call__(self, mesh: str, reason: Reason, text: str) -> None:
        self._tell(mesh, mesh, reason, shortened(text, _LONGEST))

    def together(self, refusals: Iterable[Refusal]) -> None:
        """Those that have a text. Of what several links of a robot were refused for, the text of the first is told."""
        alike: dict[tuple[str, Reason], list[Refusal]] = {}
        for refusal in refusals:
            if refusal.text and (robot := _robot(refusal)):
                alike.setdefault((robot, refusal.reason), []).append(refusal)
            elif refusal.text:
                self(refusal.mesh, refusal.reason, refusal.text)
        for (robot, reason), (first, *others) in alike.items():
            names = dict.fromkeys(other.mesh for other in others if other.mesh != first.mesh)
            more = f"; as well {listed(names)}" if names else ""
            self._tell(robot, first.mesh, reason, shortened(first.text, _LONGEST) + more)

    def _tell(self, whose: str, mesh: str, reason: Reason, text: str) -> None:
        self.last = f"{mesh}: {reason}: {text}"
        now = self._clock()
        since, count = self._silent.get((whose, reason), (-float("inf"), 0))
        if now - since < self._period:
            self._silent[whose, reason] = since, count + 1
            return
        self._silent[whose, reason] = now, 0
        self._warn(self.last + (f" ({count} more of these in between)" if count else ""))


def _robot(refusal: Refusal) -> str:
    """Of which the mesh is a link; "": of none."""
    robot, slash, _ = refusal.mesh.partition("/")
    return robot if slash and refusal.what is Input.VERTICES else ""
