# SPDX-License-Identifier: Apache-2.0
"""Transforms the positions of one mesh to the scene's frame, before frames are assembled. No ROS.

If a transform has not arrived, frames wait for it in order, as many as may wait for a topology. Frames that cannot be
transformed are rejected with the reason. A frame whose coordinate frame is not connected with the scene's blocks no
other one: it is dropped as soon as a later frame is placed, because it would then be out of order.
"""

from collections import deque
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from hpccd_core.rigid.transform import IDENTITY, Rigid
from hpccd_ros.base.quoting import quoted
from hpccd_ros.frames.coordinates import unusable_coordinates
from hpccd_ros.frames.drops import Aspect, Reason, Rejection
from hpccd_ros.frames.standstill import Standstill
from hpccd_ros.frames.transform_buffer import NoTransformError, TransformBuffer
from hpccd_ros.frames.types import ALWAYS, TF, MeshFrame, MeshSettings


class Transformed(NamedTuple):
    """Frames in the scene's frame, each with whether it is the first of a new publisher, and dropped ones."""

    frames: list[tuple[MeshFrame, bool]]
    rejections: list[Rejection]


@dataclass
class _Waiting:
    """``awaited``: the transform, in words; ``connected``: transforms connect both frames, but not at this stamp."""

    frame: MeshFrame
    new_publisher: bool
    awaited: str = ""
    connected: bool = False


class MeshTransformer:
    """Transforms the frames of ``mesh`` to the scene's frame, by its ``transform``, ``frame`` and ``pose``.

    target: the scene's frame (parameter frame_id). transforms: used if ``transform`` is "tf".
    """

    def __init__(self, mesh: MeshSettings, target: str, max_waiting: int, transforms: TransformBuffer) -> None:
        self._mesh = mesh.name
        self._asked = mesh.input == TF  # then the caller has discarded earlier samples
        self._kind = "tf" if self._asked else mesh.transform
        self._frame = mesh.frame
        self._target = target
        self._max_waiting = max_waiting
        self._transforms = transforms
        self._waiting: deque[_Waiting] = deque()
        self._standstill = Standstill()
        self._last: int | None = None  # stamp that was last looked up
        self._unnoticed = False  # the first frame of a new publisher was rejected: the next one counts as the first
        self._pose = Rigid.of(mesh.pose[:3], mesh.pose[3:]) if self._kind == "pose" else None

    @property
    def waiting(self) -> int:
        return len(self._waiting)

    def warnings(self) -> list[str]:
        """Reasons for which frames wait, if none has continued for a while."""
        waits_long = self._waiting and self._standstill.long
        return [f"{self._mesh} waits for a transform: {self._missing(self._waiting[0])}"] if waits_long else []

    def transform(self, frame: MeshFrame, new_publisher: bool = False) -> Transformed:
        """Frames that can continue after this one: with ``transform: none`` always itself."""
        if self._kind == "none":
            return Transformed([(frame, new_publisher)], [])
        if text := self._wrong_frame_id(frame):
            return Transformed([], [self._reject(Reason.FRAME_ID, text, new_publisher, frame)])
        if self._kind == "pose":
            moved = self._moved(frame, self._pose, new_publisher)
            if isinstance(moved, Rejection):
                return Transformed([], [moved])
            return Transformed([(moved, self._noticed(new_publisher))], [])
        if new_publisher and not self._asked and self._last is not None and frame.stamp <= self._last:
            self._transforms.forget_future(frame.stamp)  # before earlier samples place it
        self._last = frame.stamp
        self._waiting.append(_Waiting(frame, new_publisher))
        frames, rejections = self.retry()
        if len(self._waiting) > self._max_waiting:
            rejections.append(self._give_up(self._waiting.popleft()))
        return Transformed(frames, rejections)

    def retry(self) -> Transformed:
        """Frames that can continue now. Call it after a transform has arrived."""
        frames, rejections = [], []
        passed: list[_Waiting] = []  # before the current one, and not connected
        while self._waiting:
            item = self._waiting[0]
            try:
                source = item.frame.frame_id or self._frame
                rigid, sent = self._transforms.lookup_sent(source, self._target, item.frame.stamp)
            except NoTransformError as error:
                item.awaited, item.connected = str(error), error.connected
                if error.connected and not error.final:
                    break
                self._waiting.popleft()
                if error.final:
                    rejections.append(self._give_up(item))
                else:
                    passed.append(item)
                continue
            self._waiting.popleft()
            moved = self._moved(item.frame, rigid, item.new_publisher, sent)
            if isinstance(moved, Rejection):
                rejections.append(moved)
                continue
            rejections += [self._give_up(earlier, "; a later frame was placed") for earlier in passed]
            passed.clear()
            frames.append((moved, self._noticed(item.new_publisher)))
            self._standstill.ends()
        self._waiting.extendleft(reversed(passed))
        if self._waiting:
            self._standstill.waits()
        return Transformed(frames, rejections)

    def clear(self, reason: Reason) -> list[Rejection]:
        """Drop waiting frames, for ``reason``."""
        rejections = [Rejection(self._mesh, reason) for _ in self._waiting]
        self._waiting.clear()
        return rejections

    def _wrong_frame_id(self, frame: MeshFrame) -> str | None:
        if self._frame and frame.frame_id not in ("", self._frame):
            demanded = quoted(self._frame)
            return f"frame_id {quoted(frame.frame_id)}, parameter mesh.{self._mesh}.frame requires {demanded}"
        if self._kind == "tf" and not (frame.frame_id or self._frame):
            what = "frame_id is empty: it must say what to transform from"
            return f"{what}; set it, or parameter mesh.{self._mesh}.frame"
        return None

    def _moved(self, frame: MeshFrame, rigid: Rigid, new_publisher: bool, sent: int = ALWAYS) -> MeshFrame | Rejection:
        """sent: when the transform was sent."""
        placement = frame.placement.moved(rigid) if frame.placement is not None else None
        if placement is not None:
            vertices = placement.vertices
        else:
            # Always double, with or without a rotation: the precision of a stream must not depend on its values.
            vertices = frame.vertices if rigid is IDENTITY else rigid.apply(frame.vertices.astype(np.float64))
        if problem := unusable_coordinates(vertices, by_poses=placement is not None):
            reason, text = problem
            return self._reject(reason, f"after the transform {text}", new_publisher, frame)
        sent = min(sent, frame.sent)
        return replace(frame, vertices=vertices, frame_id=self._target, placement=placement, sent=sent)

    def _noticed(self, new_publisher: bool) -> bool:
        new_publisher, self._unnoticed = new_publisher or self._unnoticed, False
        return new_publisher

    def _give_up(self, item: _Waiting, why: str = "") -> Rejection:
        rejection = self._reject(Reason.NO_TRANSFORM, self._missing(item) + why, item.new_publisher, item.frame)
        return replace(rejection, aspect=Aspect.NOTHING) if self._asked else rejection  # then no message was rejected

    def _missing(self, item: _Waiting) -> str:
        if item.connected:
            return item.awaited
        return f"{item.awaited}; {self._transforms.account(item.frame.frame_id or self._frame)}"

    def _reject(self, reason: Reason, text: str, new_publisher: bool, frame: MeshFrame) -> Rejection:
        self._unnoticed |= new_publisher
        return Rejection(self._mesh, reason, text, sent=None if self._asked else frame.sent)
