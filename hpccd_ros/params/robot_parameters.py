# SPDX-License-Identifier: Apache-2.0
"""The parameters robot.NAME.*: the source of the description, and what moves the links."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hpccd_core.rigid.transform import Rigid
from hpccd_ros.base.quoting import shortened
from hpccd_ros.frames.types import JOINTS, MeshSettings
from hpccd_ros.params.table import ROBOT
from hpccd_ros.params.values import ParameterError, robot_rows
from hpccd_ros.robots.joint_frames import JointFrames
from hpccd_ros.robots.robot import Robot

#: Robots whose description is known.
Robots = Mapping[str, Robot]
NO_ROBOTS: Robots = {}
#: Robot -> parameters robot.NAME.*.
RobotValues = Mapping[str, Mapping[str, Any]]


def of(parameters: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Robot -> its parameters robot.NAME.*, from all parameters of a node by full name; those not set have their
    default."""
    return {
        robot: {
            row.name: row.default if (value := parameters.get(name)) is None else value
            for row, name in robot_rows(robot)
        }
        for robot in parameters.get("robots") or []
    }


def comes_on_topic(description: str) -> bool:
    """Whether parameter robot.NAME.description names a topic, whose name has no point, and no file."""
    return "." not in description


def topics(robots: RobotValues) -> dict[str, str]:
    """Robot -> topic of its description, for robots with one."""
    return {name: values["description"] for name, values in robots.items() if comes_on_topic(values["description"])}


def joint_topics(robots: RobotValues) -> dict[str, list[str]]:
    """Topic of joint states -> robots that it moves."""
    found: dict[str, list[str]] = {}
    for name, values in robots.items():
        if values["joint_states"]:
            found.setdefault(values["joint_states"], []).append(name)
    return found


def subscribed(robots: RobotValues) -> list[str]:
    """Topics of descriptions and joint states."""
    return [*dict.fromkeys(topics(robots).values()), *joint_topics(robots)]


def need_transforms(robots: RobotValues) -> bool:
    """Whether transforms move a robot, or its base."""
    return any(not (values["joint_states"] and values["pose"]) for values in robots.values())


def check(settings: dict[str, Any]) -> None:
    """Raises ParameterError."""
    for name, values in settings[ROBOT].items():
        prefix = f"{ROBOT}.{name}"
        if not values["description"]:
            raise ParameterError(
                f"{prefix}.description: empty; give the name of a topic, as robot_description, or of a URDF file"
            )
        pose(name, values)
        if values["pose"] and not values["joint_states"]:
            raise ParameterError(
                f"{prefix}.pose: is for a robot that joint states move; give {prefix}.joint_states, or leave the pose "
                "to transforms"
            )
        if need_transforms({name: values}) and not settings["frame_id"]:
            raise ParameterError(_unplaced(prefix, values))


def unusable_home(robots: RobotValues) -> str | None:
    """An error about a robot's file in the home folder of a user that does not exist, or None."""
    for name, values in robots.items():
        files = ["srdf"] if comes_on_topic(values["description"]) else ["description", "srdf"]
        for parameter in files:
            try:
                Path(values[parameter]).expanduser()
            except RuntimeError:  # ~name, and there is no such user
                return (
                    f"{ROBOT}.{name}.{parameter}: {shortened(values[parameter])}: no such home folder; give the whole "
                    "path"
                )
    return None


def _unplaced(prefix: str, values: Mapping[str, Any]) -> str:
    """The error if neither a pose nor a frame places the links, with the remedy."""
    if values["joint_states"]:
        return (
            f"{prefix}.pose: not given, so that transforms place the root link; give it, or set parameter frame_id, "
            "the frame to transform to"
        )
    return (
        f"{prefix}.joint_states: not given, so that transforms move the links; give the topic of its joint states and "
        f"{prefix}.pose, where its root link stands, or set parameter frame_id, the frame to transform to"
    )


def pose(name: str, values: Mapping[str, Any]) -> Rigid | None:
    """robot.NAME.pose; None: not given. Raises ParameterError."""
    numbers = values["pose"]
    if not numbers:
        return None
    try:
        if len(numbers) != 7:
            raise ValueError(
                f"has {len(numbers)} numbers; x y z of a translation and x y z w of a quaternion are seven"
            )
        return Rigid.of(numbers[:3], numbers[3:])
    except ValueError as error:
        raise ParameterError(f"{ROBOT}.{name}.pose: {shortened(numbers)} {error}") from error


def links(robots: Robots) -> dict[str, tuple[str, ...]]:
    """Robot -> names of its meshes."""
    return {name: tuple(mesh.name for mesh in robot.meshes) for name, robot in robots.items()}


def mesh_settings(settings: dict[str, Any], robots: Robots) -> tuple[MeshSettings, ...]:
    """Settings of all links, in the order of the parameter ``robots`` and of the descriptions. An unknown robot is a
    mesh whose frames never arrive, because no step can be computed without it."""
    found: list[MeshSettings] = []
    for name, values in settings[ROBOT].items():
        if name in robots:
            found += robots[name].settings(values["frame_prefix"], by_joints=bool(values["joint_states"]))
        else:
            found.append(MeshSettings(name, self_collision=False, input=JOINTS))
    return tuple(found)


def followers(settings: dict[str, Any], robots: Robots, most_waiting: int) -> dict[str, JointFrames]:
    """Robot -> frames of its links, for robots that joint states move."""
    return {
        name: JointFrames(
            robots[name],
            pose(name, values),
            values["frame_prefix"] + robots[name].description.root,
            settings["frame_id"],
            most_waiting,
        )
        for name, values in settings[ROBOT].items()
        if name in robots and values["joint_states"]
    }
