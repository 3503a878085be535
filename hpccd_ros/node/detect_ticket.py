# SPDX-License-Identifier: Apache-2.0
"""A request on its way to its answer. No ROS."""

import math
import time
from collections.abc import Callable

from hpccd_ros.detect.cancellation import Cancellation


class Ticket:
    """``stage``: what is done for it now. ``ended``: how it ended, a name in Accounts.requests; "" before.

    on_place: called when it has found a place among those that are computed or wait.
    """

    def __init__(self, stage: str, on_place: Callable[[], None] = lambda: None) -> None:
        self.stage = stage
        self.on_place = on_place
        self.ended = ""
        self.time_limit = math.nan
        self.given_up: tuple[str, str] | None = None  # how it is to end, and the reason in words
        self.settle: Callable[[], None] = lambda: None  # whoever waits for its answer waits no longer
        self.cancellation = Cancellation()
        self._since = time.monotonic()

    @property
    def seconds(self) -> float:
        """Since it came."""
        return time.monotonic() - self._since

    def enter(self, stage: str) -> None:
        """From the thread that computes."""
        self.stage = stage

    def give_up(self, ended: str, why: str) -> None:
        """It is answered with ``why``, now, unless it was given up before. From the executor's thread."""
        if self.given_up is None:
            self.given_up = ended, why
            self.cancellation.cancel()
            self.settle()
