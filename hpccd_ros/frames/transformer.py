# SPDX-License-Identifier: Apache-2.0
"""Bring the positions of one mesh into the scene's frame, before frames are assembled. No ROS.

Where a transform has not come yet, frames wait for it in the order in which they came, as many as may wait for
a topology; what cannot be transformed is counted with the reason. A frame whose coordinate frame nothing connects
with the scene's, so that none may ever come, holds up nobody: it gives way as soon as a frame behind it is placed, as
it could only come out of order from then on.
"""

from collections import deque
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hpccd_ros.base.quoting import quoted
from hpccd_ros.frames import coordinates
from hpccd_ros.frames.drops import DropCounter, Reason
from hpccd_ros.frames.rigid import IDENTITY, Rigid
from hpccd_ros.frames.transform_buffer import NoTransformError, TransformBuffer
from hpccd_ros.frames.types import MeshFrame

# A frame that is ready, and whether it is the first of a new publisher.
Ready = tuple[MeshFrame, bool]


@dataclass
class _Waiting:
    """``awaited``: the transform, in words."""

    frame: MeshFrame
    new_publisher: bool
    awaited: str = ""


class Placement:
    """How the frames of ``mesh`` are placed: parameters mesh.NAME.transform, .frame, .pose (``row``).

    target: the scene's frame (parameter frame_id). transforms: None where transform is not "tf".
    """

    def __init__(
        self,
        mesh: str,
        row: dict[str, Any],
        target: str,
        max_waiting: int,
        drops: DropCounter,
        transforms: TransformBuffer | None = None,
    ) -> None:
        self._mesh = mesh
        self._kind = row["transform"]
        self._frame = row["frame"]
        self._target = target
        self._max_waiting = max_waiting
        self._drops = drops
        self._transforms = transforms
        self._waiting: deque[_Waiting] = deque()
        self._unnoticed = False  # the first frame of a new publisher was refused: the next one stands for it
        self._pose = Rigid.of(row["pose"][:3], row["pose"][3:]) if self._kind == "pose" else None

    @property
    def waiting(self) -> int:
        return len(self._waiting)

    def warnings(self) -> list[str]:
        """What the frames that wait are waiting for."""
        return [f"{self._mesh} waits for a transform: {self._waiting[0].awaited}"] if self._waiting else []

    def take(self, frame: MeshFrame, new_publisher: bool = False) -> list[Ready]:
        """Frames in the scene's frame that this one completes: with ``transform: none`` always itself."""
        if self._kind == "none":
            return [(frame, new_publisher)]
        if self._frame and frame.frame_id not in ("", self._frame):
            text = f"frame_id {quoted(frame.frame_id)}, parameter mesh.{self._mesh}.frame demands {quoted(self._frame)}"
            self._refuse(Reason.FRAME_ID, text, new_publisher)
            return []
        if self._kind == "pose":
            placed = self._placed(frame, self._pose, new_publisher)
            return [] if placed is None else [(placed, self._noticed(new_publisher))]
        if not (frame.frame_id or self._frame):
            text = "frame_id is empty: it must say what to transform from; set it, or parameter "
            self._refuse(Reason.FRAME_ID, f"{text}mesh.{self._mesh}.frame", new_publisher)
            return []
        self._waiting.append(_Waiting(frame, new_publisher))
        ready = self.retry()
        if len(self._waiting) > self._max_waiting:
            self._give_up(self._waiting.popleft())
        return ready

    def retry(self) -> list[Ready]:
        """Frames that can be placed now; call after a transform has come."""
        ready = []
        passed: list[_Waiting] = []  # before the one that is looked at, and not connected
        while self._waiting:
            item = self._waiting[0]
            try:
                rigid = self._transforms.lookup(item.frame.frame_id or self._frame, self._target, item.frame.stamp)
            except NoTransformError as error:
                item.awaited = str(error)
                if error.connected and not error.final:
                    break
                self._waiting.popleft()
                if error.final:
                    self._give_up(item)
                else:
                    passed.append(item)
                continue
            self._waiting.popleft()
            placed = self._placed(item.frame, rigid, item.new_publisher)
            if placed is not None:
                for earlier in passed:
                    self._give_up(earlier, "; a later frame was placed")
                passed.clear()
                ready.append((placed, self._noticed(item.new_publisher)))
        self._waiting.extendleft(reversed(passed))
        return ready

    def clear(self, reason: Reason) -> None:
        """Drop what waits, counted as ``reason``."""
        for _ in self._waiting:
            self._drops.count(self._mesh, reason)
        self._waiting.clear()

    def _placed(self, frame: MeshFrame, rigid: Rigid, new_publisher: bool) -> MeshFrame | None:
        # Always double, with or without a rotation: the precision of a stream must not depend on its values.
        vertices = frame.vertices if rigid is IDENTITY else rigid.apply(frame.vertices.astype(np.float64))
        if refusal := coordinates.refusal(vertices):
            reason, text = refusal
            self._refuse(reason, f"after the transform {text}", new_publisher)
            return None
        return replace(frame, vertices=vertices, frame_id=self._target)

    def _noticed(self, new_publisher: bool) -> bool:
        new_publisher, self._unnoticed = new_publisher or self._unnoticed, False
        return new_publisher

    def _give_up(self, item: _Waiting, why: str = "") -> None:
        self._refuse(Reason.NO_TRANSFORM, item.awaited + why, item.new_publisher)

    def _refuse(self, reason: Reason, text: str, new_publisher: bool) -> None:
        self._unnoticed |= new_publisher
        self._drops.count(self._mesh, reason, text)
