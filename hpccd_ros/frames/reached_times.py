# SPDX-License-Identifier: Apache-2.0
"""The stamps of frames where transforms or joints alone move the scene: times that all of them have reached. No ROS."""

from hpccd_ros.frames.restart import IncreasingStamps
from hpccd_ros.frames.samples import RESTART_AFTER, RESTART_NS


class ReachedTimes:
    """``anew``: the time that goes on is of another run than the one before. ``set_back``: because something has begun
    anew; else only a stamp far ahead was left out, and what is known of any time stays.

    What goes back by more than a second has begun anew. What goes back by less is a restart as that of a mesh is: after
    ``restart_after`` increasing stamps in a row, of which whatever has begun anew had RESTART_AFTER already.
    """

    def __init__(self) -> None:
        self.anew = self.set_back = False
        self._last: int | None = None  # of the last frame
        self._begun = 0  # when that was
        self._behind = IncreasingStamps()
        self._in_a_row = 0
        self._behind_last: int | None = None  # the stamp behind it that was looked at last

    def goes_on(self, stamp: int, begun: int, restart_after: int) -> bool:
        """Whether there is a frame at ``stamp`` ns, which all have reached now. begun: how often one of them began
        anew."""
        last = self._last
        self.anew = last is not None and stamp < last and self._is_anew(stamp, last, begun, restart_after)
        if last is not None and stamp <= last and not self.anew:
            return False
        self.set_back = self.anew and begun != self._begun
        self._last, self._begun = stamp, begun
        self._behind, self._behind_last = IncreasingStamps(), None
        return True

    def _is_anew(self, stamp: int, last: int, begun: int, restart_after: int) -> bool:
        if stamp < last - RESTART_NS:
            return True
        if begun == self._begun or not restart_after:
            return False
        if stamp != self._behind_last:
            self._behind_last, self._in_a_row = stamp, self._behind.next(stamp)
        return self._in_a_row + RESTART_AFTER - 1 >= restart_after
