# SPDX-License-Identifier: Apache-2.0
"""Times at which frames are requested of meshes that transforms or joints move."""

from collections.abc import Sequence

from hpccd_ros.frames.follower import Follower
from hpccd_ros.frames.restart import IncreasingStamps
from hpccd_ros.frames.samples import RESTART_AFTER, RESTART_NS
from hpccd_ros.frames.standstill import Standstill
from hpccd_ros.frames.transform_buffer import NoTransformError, TransformBuffer
from hpccd_ros.frames.types import MeshSettings


class RequestedTimes:
    """The meshes whose frames are requested, and the time that all their inputs have reached.

    by_transforms: meshes that TF moves. followers: of meshes that joints move. frame_id: of the scene.
    """

    def __init__(self, by_transforms: Sequence[MeshSettings], followers: Sequence[Follower], frame_id: str) -> None:
        self.by_transforms = by_transforms
        self.followers = followers
        self._frame_id = frame_id

    def use(self, transforms: TransformBuffer) -> None:
        """Follow these transforms from now on."""
        self.transforms = transforms
        self.reached = ReachedTimes()
        self._without_time = Standstill()

    def next(self, restart_after: int) -> int | None:
        """The stamp of a new frame that all inputs have reached; None: there is none."""
        try:
            stamp = self._latest()
        except NoTransformError:
            return None
        begun = self.transforms.begun + sum(follower.begun for follower in self.followers)
        return stamp if stamp is not None and self.reached.goes_on(stamp, begun, restart_after) else None

    def forget_future(self, stamp: int) -> None:
        """Drop samples beyond ``stamp``, at which a new run begins."""
        self.transforms.forget_future(stamp)
        for follower in self.followers:
            follower.forget_future(stamp)

    def warnings(self) -> list[str]:
        """Why no time is known, if that has lasted."""
        try:
            self._latest()
        except NoTransformError as error:
            self._without_time.waits()
            if error.reported:
                return []
            account = "" if error.connected else f"; {self.transforms.account(error.source)}"
            return [f"no frame yet: {error}{account}"] if self._without_time.long else []
        self._without_time.ends()
        return []

    def unplaced(self) -> list[str]:
        """Names of the meshes that no transforms connect with the scene."""
        return [mesh.name for mesh in self.by_transforms if not self._is_placed(mesh)]

    def _is_placed(self, mesh: MeshSettings) -> bool:
        try:
            self.transforms.latest(mesh.frame, self._frame_id)
        except NoTransformError:
            return False
        return True

    def _latest(self) -> int | None:
        """The time that all inputs have reached; None: none of them has stamps. Raises NoTransformError."""
        reached = [self.transforms.latest(mesh.frame, self._frame_id) for mesh in self.by_transforms]
        reached += [stamp for follower in self.followers for stamp in follower.latest(self.transforms)]
        return min((stamp for stamp in reached if stamp is not None), default=None)


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
