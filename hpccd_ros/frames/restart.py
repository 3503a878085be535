# SPDX-License-Identifier: Apache-2.0
"""Distinguishes a restarted stream from stray messages by increasing stamps in a row: the order of the stamps of a mesh
and the coordinate frame of the scene, rules 4 and 3 of the assembler. No ROS."""

from dataclasses import dataclass

from hpccd_ros.base.quoting import quoted
from hpccd_ros.frames.drops import Reason, Rejection
from hpccd_ros.frames.types import MeshFrame


@dataclass(frozen=True)
class Restart:
    """The stream restarts with the current message; ``text``: why."""

    text: str


class IncreasingStamps:
    """Counts messages with increasing stamps in a row."""

    def __init__(self) -> None:
        self._count = 0
        self._last = 0

    def next(self, stamp: int) -> int:
        self._count = self._count + 1 if stamp > self._last else 1
        self._last = stamp
        return self._count


class StampOrder:
    """The state of the stamps of ``mesh``, ns."""

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

    def check(self, stamp: int, restart_after: int, from_new_publisher: bool) -> Rejection | Restart | None:
        """None if the message is in order."""
        last = self._last
        if last is None or stamp > last:
            return None
        if stamp == last and not from_new_publisher:
            text = f"stamp {stamp} ns came before; each frame needs a later stamp than the one before"
            return Rejection(self._mesh, Reason.REPEATED, text)
        if 0 < restart_after <= self._backward.next(stamp) or from_new_publisher:
            return Restart(f"mesh {self._mesh} continues from stamp {stamp} ns after {last} ns")
        return Rejection(self._mesh, Reason.BACKWARD, f"stamp {stamp} ns is before the last one, {last} ns")


class CoordinateFrame:
    """``name``: the current frame, "" before any message names one. demanded: the required one; "": that of the first
    message."""

    def __init__(self, demanded: str) -> None:
        self._demanded = demanded
        self.reset()

    def reset(self) -> None:
        """As before the first message."""
        self.name = self._demanded
        self._set_by = ""
        self._elsewhere: dict[str, tuple[str, IncreasingStamps]] = {}  # mesh -> the other frame in which it sends

    @property
    def source(self) -> str:
        """The source of the current frame; "" if there is none."""
        if self._demanded:
            return "parameter frame_id"
        return f"a message of mesh {self._set_by}" if self._set_by else ""

    def adopt(self, mesh: str, frame_id: str) -> None:
        """Call it for accepted messages: the first that names a frame sets that of the scene."""
        if frame_id and not self.name:
            self.name, self._set_by = frame_id, mesh

    def check(
        self, mesh: str, frame: MeshFrame, restart_after: int, from_new_publisher: bool
    ) -> Rejection | Restart | None:
        """None if the message fits. from_new_publisher: the publisher is new and the only one of its mesh."""
        if not frame.frame_id or not self.name:
            return None
        if frame.frame_id == self.name:
            self._elsewhere.clear()
            return None
        if not self._demanded:
            frame_id, run = self._elsewhere.get(mesh, ("", IncreasingStamps()))
            if frame_id != frame.frame_id:
                run = IncreasingStamps()
            self._elsewhere[mesh] = frame.frame_id, run
            if 0 < restart_after <= run.next(frame.stamp) or from_new_publisher:
                return Restart(f"mesh {mesh} continues in frame {quoted(frame.frame_id)} after {quoted(self.name)}")
        return self._reject(mesh, frame)

    def check_static(self, mesh: str, frame: MeshFrame) -> Rejection | None:
        """Positions of a static mesh may be in any frame, unless one is required."""
        fits = not self._demanded or frame.frame_id in ("", self._demanded)
        return None if fits else self._reject(mesh, frame)

    def _reject(self, mesh: str, frame: MeshFrame) -> Rejection:
        text = (
            f"frame_id {quoted(frame.frame_id)}, the scene is in {quoted(self.name)} (by {self.source}); publish all "
            "meshes in one coordinate frame"
        )
        return Rejection(mesh, Reason.FRAME_ID, text, sent=frame.sent)
