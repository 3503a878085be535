# SPDX-License-Identifier: Apache-2.0
"""Meshes of which nobody sends frames: what moves all of them at once is looked up at stamps that others give. No ROS.

Transforms, which move each mesh alone, are the pipeline's own matter.
"""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from hpccd_ros.frames.drops import Reason, Refusal
from hpccd_ros.frames.restart import IncreasingStamps
from hpccd_ros.frames.samples import RESTART_AFTER, RESTART_NS
from hpccd_ros.frames.transform_buffer import TransformBuffer
from hpccd_ros.frames.types import MeshFrame


class Followed(NamedTuple):
    """``times``: for each stamp that goes on now, (mesh, frame in the scene's frame, whether a new publisher)."""

    refusals: list[Refusal]
    times: list[list[tuple[str, MeshFrame, bool]]]


class Follower(Protocol):
    """``names``: of the meshes, in the order of the scene. ``waiting``: their frames asked for and not known yet.
    ``begun``: how often the time of what moves them went back, and all that was known of it began anew."""

    @property
    def names(self) -> Sequence[str]: ...

    @property
    def waiting(self) -> int: ...

    @property
    def begun(self) -> int: ...

    def ask(self, stamp: int, received: float, new_publisher: bool) -> None:
        """A frame of each mesh at ``stamp`` ns; `retry` tells what comes of it."""

    def retry(self, transforms: TransformBuffer) -> Followed:
        """What is known now of the frames asked for."""

    def latest(self, transforms: TransformBuffer) -> list[int | None]:
        """Stamps up to which is known what moves the meshes; None: it is bound to no time. Raises NoTransformError:
        something has not come at all."""

    def clear(self, reason: Reason) -> list[Refusal]:
        """Drop what waits, for ``reason``."""

    def forget_future(self, stamp: int) -> None:
        """The time is ``stamp`` again: what is known of times far beyond it is from before."""

    def forget(self) -> None:
        """All that is known of any time."""

    def warnings(self) -> list[str]:
        """What the frames asked for wait for."""


class ReachedTimes:
    """Which stamps are reached by all inputs.

    ``restarted``: the last stamp belongs to a new run. ``set_back``: an input restarted; otherwise only a stamp far
    ahead was dropped, and samples of all times stay valid.

    Stamps that go back by more than a second are a restart. Smaller steps back are a restart after ``restart_after``
    increasing stamps in a row, as for meshes; an input that restarted has had RESTART_AFTER of them already.
    """

    def __init__(self) -> None:
        self.restarted = self.set_back = False
        self._last: int | None = None  # of the last frame
        self._begun = 0  # when that was
        self._behind = IncreasingStamps()
        self._in_a_row = 0
        self._behind_last: int | None = None  # the stamp behind it that was looked at last

    def goes_on(self, stamp: int, begun: int, restart_after: int) -> bool:
        """Whether there is a frame at ``stamp`` ns, which all inputs have reached. begun: restarts of inputs so far."""
        last = self._last
        self.restarted = last is not None and stamp < last and self._restarted(stamp, last, begun, restart_after)
        if last is not None and stamp <= last and not self.restarted:
            return False
        self.set_back = self.restarted and begun != self._begun
        self._last, self._begun = stamp, begun
        self._behind, self._behind_last = IncreasingStamps(), None
        return True

    def _restarted(self, stamp: int, last: int, begun: int, restart_after: int) -> bool:
        if stamp < last - RESTART_NS:
            return True
        if begun == self._begun or not restart_after:
            return False
        if stamp != self._behind_last:
            self._behind_last, self._in_a_row = stamp, self._behind.next(stamp)
        return self._in_a_row + RESTART_AFTER - 1 >= restart_after
