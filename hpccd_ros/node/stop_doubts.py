# SPDX-License-Identifier: Apache-2.0
"""Doubts about single meshes: a newer message was rejected, so the mesh's position, shape or topology is unknown until
a valid one arrives. No ROS."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.frames.drops import Aspect, Input, Reason, Rejection
from hpccd_ros.frames.types import TF, Origin
from hpccd_ros.params import robot_parameters
from hpccd_ros.params.table import ROBOT

# Valid messages that were replaced: by a newer message, a frame of another mesh, or a scene without that mesh. If joint
# states or transforms are missing, there are no further frames, and the age of the last one reveals it.
GAVE_WAY = {
    Reason.UNKNOWN_MESH,
    Reason.LATE,
    Reason.INCOMPLETE,
    Reason.RESTART,
    Reason.OVERLOAD,
    Reason.MIDDLEWARE,
    Reason.STOPPED,
}
_ASPECTS = {Aspect.PLACE: "positions", Aspect.SHAPE: "the shape", Aspect.TOPOLOGY: "the topology"}


@dataclass(frozen=True)
class WatchedScene:
    """Names of the ``meshes`` of a scene, in its order; ``moving``: whether each of them moves. ``by_joints``: topic of
    joint states -> meshes that these move; ``by_transforms``: moving meshes that transforms place."""

    meshes: tuple[str, ...] = ()
    moving: tuple[bool, ...] = ()
    by_joints: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    by_transforms: tuple[str, ...] = ()

    @classmethod
    def of(
        cls, builder: SceneBuilder, settings: Mapping[str, Any], links: Mapping[str, Sequence[str]]
    ) -> "WatchedScene":
        """links: robot -> names of its meshes, for the robots that are known."""
        robots = settings[ROBOT]
        by_joints = {
            topic: tuple(name for robot in moved for name in links.get(robot, ()))
            for topic, moved in robot_parameters.joint_topics(robots).items()
        }
        based = {name for robot, values in robots.items() if not values["pose"] for name in links.get(robot, ())}
        return cls(
            tuple(mesh.name for mesh in builder.meshes),
            tuple(not mesh.static for mesh in builder.meshes),
            by_joints,
            tuple(
                mesh.name
                for mesh in builder.meshes
                if not mesh.static and (mesh.transform == "tf" or mesh.input == TF or mesh.name in based)
            ),
        )

    def concerned(self, what: Input | None, name: str) -> tuple[str, ...]:
        """Meshes that are unknown after such an input of this mesh or topic was rejected; None: all that move."""
        if what is None:
            return tuple(mesh for mesh, moves in zip(self.meshes, self.moving, strict=True) if moves)
        if what is Input.TRANSFORM:
            return self.by_transforms
        if what is Input.JOINT_STATE:
            return self.by_joints.get(name, ())
        return (name,) if name in self.meshes else ()


class Source(NamedTuple):
    """The subject of a doubt in any scene: arguments of `WatchedScene.concerned`, and the aspect."""

    what: Input | None
    name: str
    aspect: Aspect

    @property
    def of_mesh(self) -> bool:
        """Whether it is one mesh. Otherwise it is a topic, or all meshes, and may concern a later scene only."""
        return self.what not in (None, Input.TRANSFORM, Input.JOINT_STATE)


@dataclass(frozen=True)
class Doubt:
    """``meshes`` are unknown until, for each of them, a message about this ``aspect`` is in use that was sent after
    ``sent``, ns. A doubt without meshes waits for a scene that has some."""

    meshes: tuple[str, ...]
    aspect: Aspect
    sent: int
    text: str

    def settled(self, origins: Mapping[str, Origin]) -> bool:
        """Whether a frame with these origins settles it."""
        if not self.meshes:
            return False
        return all(origins[mesh].of(self.aspect) > self.sent for mesh in self.meshes if mesh in origins)


def leaves_unknown(rejection: Rejection) -> bool:
    """Whether something newer than what is in use was rejected."""
    return rejection.reason not in GAVE_WAY and rejection.aspect is not Aspect.NOTHING


def text_of(rejection: Rejection) -> str:
    """Why stop is true, as a sentence without its full stop."""
    if rejection.what is Input.JOINT_STATE and rejection.reason is Reason.CONTRADICTED:
        return f"two publishers on {rejection.mesh} contradict each other"
    if rejection.reason is Reason.STATIC_MISSING:
        return f"static mesh {rejection.mesh} has a new topology and no positions yet"
    if rejection.what in (Input.JOINT_STATE, Input.TRANSFORM):
        return f"{rejection.what} on {rejection.mesh} rejected: {rejection.reason}"
    return f"{_ASPECTS[rejection.aspect]} of mesh {rejection.mesh} rejected: {rejection.reason}"
