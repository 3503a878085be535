# SPDX-License-Identifier: Apache-2.0
"""The order of the stamps of one mesh: rule 4 of the assembler. No ROS."""

from hpccd_ros.frames.drops import Reason, Refusal
from hpccd_ros.frames.restart import IncreasingStamps, Restart


class StampOrder:
    """What is known of the stamps of ``mesh``, ns."""

    def __init__(self, mesh: str) -> None:
        self._mesh = mesh
        self.reset()

    def reset(self) -> None:
        """As before the first message."""
        self._last: int | None = None
        self._backward = IncreasingStamps()

    def accept(self, stamp: int) -> None:
        self._last = stamp
        self._backward = IncreasingStamps()

    def check(self, stamp: int, restart_after: int, from_new_publisher: bool) -> Refusal | Restart | None:
        """None where the message comes in order."""
        last = self._last
        if last is None or stamp > last:
            return None
        if stamp == last and not from_new_publisher:
            text = f"stamp {stamp} ns came before; each frame needs a later stamp than the one before"
            return Refusal(self._mesh, Reason.REPEATED, text)
        if 0 < restart_after <= self._backward.next(stamp) or from_new_publisher:
            return Restart(f"mesh {self._mesh} goes on from stamp {stamp} ns after {last} ns")
        return Refusal(self._mesh, Reason.BACKWARD, f"stamp {stamp} ns is before the last one, {last} ns")
