# SPDX-License-Identifier: Apache-2.0
"""Frames of all links of a robot that joint states move, at the stamps of other meshes.

Requested frames wait in order until joint states, and the transform of the base if one is needed, have passed their
stamp: values are interpolated, never extrapolated.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from hpccd_core.rigid.transform import Rigid
from hpccd_ros.frames.drops import Aspect, Reason, Rejection
from hpccd_ros.frames.follower import Followed
from hpccd_ros.frames.standstill import Standstill
from hpccd_ros.frames.transform_buffer import NoTransformError, TransformBuffer
from hpccd_ros.frames.types import MeshFrame
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.joint_history import JointHistory, NoJointStateError
from hpccd_ros.robots.robot import Robot
from hpccd_ros.robots.urdf import RobotJoint


@dataclass
class _Asked:
    """``awaited``: what it waits for, in words."""

    stamp: int
    received: float
    new_publisher: bool
    awaited: str = ""


class JointFrames:
    """A frames.follower.Follower. ``names``: of the meshes of ``robot``.

    base: pose of the root link in the scene; None: the transform from the frame ``root`` to ``target``, that of the
    scene. most_waiting: frames of each mesh.
    """

    def __init__(self, robot: Robot, base: Rigid | None, root: str, target: str, most_waiting: int) -> None:
        self.names: Sequence[str] = tuple(mesh.name for mesh in robot.meshes)
        self._robot = robot
        self._base = base
        self._root = root
        self._target = target
        self._most_waiting = most_waiting
        self._history = JointHistory(robot.kinematics)
        self.add = self._history.add  # joint states
        self._waiting: deque[_Asked] = deque()
        self._standstill = Standstill()

    @property
    def waiting(self) -> int:
        return len(self._waiting) * len(self.names)

    @property
    def joints(self) -> dict[str, RobotJoint]:
        """The joints that need a position, by name."""
        needed = set(self._robot.kinematics.inputs)
        return {joint.name: joint for joint in self._robot.description.joints if joint.name in needed}

    @property
    def begun(self) -> int:
        return self._history.begun

    def ask(self, stamp: int, received: float, new_publisher: bool) -> None:
        self._waiting.append(_Asked(stamp, received, new_publisher))

    def retry(self, transforms: TransformBuffer) -> Followed:
        rejections: list[Rejection] = []
        times: list[list[tuple[str, MeshFrame, bool]]] = []
        while self._waiting:
            asked = self._waiting[0]
            try:
                frames = self._frames(asked, transforms)
            except (NoJointStateError, NoTransformError) as error:
                asked.awaited = str(error)
                too_many = len(self._waiting) > self._most_waiting
                if not (error.final or too_many):
                    break
                lacking = isinstance(error, NoJointStateError)
                reason = Reason.NO_JOINT_STATE if lacking else Reason.NO_TRANSFORM
                rejections += self._rejected(reason, asked.awaited, Aspect.NOTHING)  # no message was rejected
            except RobotError as error:
                rejections += self._rejected(Reason.OUT_OF_RANGE, str(error), Aspect.PLACE)
            else:
                times.append(frames)
                self._standstill.ends()
            self._waiting.popleft()
        if self._waiting:
            self._standstill.waits()
        return Followed(rejections, times)

    def latest(self, transforms: TransformBuffer) -> list[int | None]:
        try:
            of_joints = self._history.latest()
        except NoJointStateError as error:
            text = f"{self._robot.name}: {error}"
            raise NoTransformError(text, final=False, reported=self._history.misnamed) from error
        if self._base is not None:
            return [of_joints]
        try:
            return [of_joints, transforms.latest(self._root, self._target)]
        except NoTransformError as error:
            text = f"{error}; {self._remedy}"
            raise NoTransformError(text, error.final, error.connected, error.source) from error

    def clear(self, reason: Reason) -> list[Rejection]:
        rejections = [Rejection(name, reason) for _ in self._waiting for name in self.names]
        self._waiting.clear()
        return rejections

    def forget_future(self, stamp: int) -> None:
        self._history.forget_future(stamp)

    def forget(self) -> None:
        self._history.clear()

    def warnings(self) -> list[str]:
        # Joint states that name no joint of the robot have a warning of their own.
        waits_long = self._waiting and self._standstill.long and not self._history.misnamed
        return [f"{self._robot.name} waits: {self._waiting[0].awaited}"] if waits_long else []

    def _frames(self, asked: _Asked, transforms: TransformBuffer) -> list[tuple[str, MeshFrame, bool]]:
        values = self._history.at(asked.stamp)
        base, sent = self._base, self._history.sent_at(asked.stamp)
        if base is None:
            base, of_base = self._base_by_transforms(asked.stamp, transforms)
            sent = min(sent, of_base)
        # One state for all links, so that a step computes the joints once.
        placements = self._robot.placements(self._robot.kinematics.state(values, base))
        return [
            (
                name,
                MeshFrame(
                    asked.stamp,
                    placement.vertices,
                    version=0,
                    frame_id=self._target,
                    received=asked.received,
                    placement=placement,
                    sent=sent,
                ),
                asked.new_publisher,
            )
            for name, placement in zip(self.names, placements, strict=True)
        ]

    def _base_by_transforms(self, stamp: int, transforms: TransformBuffer) -> tuple[Rigid, int]:
        """The pose of the base, and the time at which its transform was sent."""
        try:
            return transforms.lookup_sent(self._root, self._target, stamp)
        except NoTransformError as error:
            if error.connected:
                raise
            text = f"{error}; {self._remedy}; {transforms.account(self._root)}"
            raise NoTransformError(text, error.final, connected=False) from error

    @property
    def _remedy(self) -> str:
        """For a missing transform of the base."""
        return f"publish that, or give parameter robot.{self._robot.name}.pose"

    def _rejected(self, reason: Reason, text: str, aspect: Aspect) -> list[Rejection]:
        """The text only once, because it is about the robot, not a link."""
        first, *others = self.names
        return [
            Rejection(first, reason, text, aspect=aspect),
            *(Rejection(name, reason, aspect=aspect) for name in others),
        ]
