# SPDX-License-Identifier: Apache-2.0
"""The scene of a recording: what the node knew from its parameters and mesh files when it was recorded."""

import dataclasses
import functools
import tempfile
from collections.abc import Callable
from pathlib import Path, PurePosixPath

from hpccd_core import MeshFileError, load_mesh
from hpccd_core.mesh_files.load import FORMATS
from hpccd_ros.bag.reader import Recording, RecordingError
from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import printable
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.frames.rigid_mesh import mesh_of_file
from hpccd_ros.frames.types import MeshFrame, Topology
from hpccd_ros.middleware import resources, topic_names, transform_topics
from hpccd_ros.params import pair_parameters, robot_parameters, scene_parameters, unknown, values
from hpccd_ros.params.parameter_file import read_parameters
from hpccd_ros.params.table import ROBOT
from hpccd_ros.params.values import ParameterError
from hpccd_ros.record import recorded_topics
from hpccd_ros.record.attachments import attachment_name
from hpccd_ros.replay import recorded_robots
from hpccd_ros.robots.robot import Robot


@dataclasses.dataclass(frozen=True)
class ReplaySetup:
    """Node settings and mesh settings as `parameters.declare` gives them, and the topics by what they carry."""

    settings: dict
    meshes: dict[str, dict]
    # Topic name -> (mesh, "topology" or one of topic_names.POSITIONS), or ("", name in transform_topics.ALL, or that of
    # joint states as the parameters have it).
    roles: dict[str, tuple[str, str]]
    contacts: str | None  # topic name; None: the recording has none
    distances: str | None  # as well
    files: dict[str, tuple[Topology, MeshFrame | None]]  # of meshes that come from a file; frame: static ones
    robots: dict[str, Robot]
    described_on: list[str]  # topic names of the descriptions that came on one
    unknown: list[str]  # parameters that the node does not have: without effect
    # The robots, made of their visual geometry. Takes time, and the recording must be open.
    visual: Callable[[], dict[str, Robot]]

    @property
    def builder(self) -> SceneBuilder:
        return scene_parameters.scene_builder(self.settings, self.meshes, self.robots)

    @property
    def mesh_names(self) -> list[str]:
        """In the order of the scene, planes last."""
        return list(self.builder.names)

    def options(self, accuracy: str, backend: str, threads: int) -> Options:
        """Detector options of the recorded node, but for what may differ without a change of the result."""
        return Options(
            accuracy or self.settings["accuracy"],
            backend,
            threads,
            self.settings["report"],
            separation=pair_parameters.separation(self.settings, robot_parameters.links(self.robots)),
            features=scene_parameters.features(self.settings),
            rigid=scene_parameters.rigid(self.settings),
            thickness=pair_parameters.thickness(self.settings, robot_parameters.links(self.robots)),
        )


def of_recording(recording: Recording, parameter_file: str | None = None) -> ReplaySetup:
    """Setup from what `hpccd record` stored, or from a parameter file for a recording of another recorder.

    Both are checked as the node checks its parameters. Raises RecordingError where the recording, UserError where the
    file does not tell what the meshes are, or tells what cannot be.
    """
    info = recording.info or {}
    try:
        if parameter_file:
            where, rejected = f"--params {parameter_file}", UserError
            given = read_parameters(parameter_file)
        else:
            where, rejected = f"{recording.path}: the stored parameters", RecordingError
            given = _stored(recording, info)
        settings, meshes = values.checked(given)
        if not settings["meshes"] and not settings["robots"]:
            raise ParameterError("parameter `meshes` names no mesh, and `robots` no robot")
        if not settings["robots"] and all(row["static"] for row in meshes.values()):
            raise ParameterError("at least one mesh must not be static, otherwise nothing moves")
        scene_parameters.check(settings, meshes)
        without_effect = values.unknown(given, meshes, settings["robots"], settings["planes"])
        if parameter_file:  # what is stored may be of another version
            without_effect = unknown.check(without_effect, settings)
    except ParameterError as error:
        raise rejected(printable(f"{where}: {error}")) from error
    of_robots = settings[ROBOT]
    by_role = _by_role(recording, info, recorded_topics.types_by_role(meshes, of_robots))
    joint_topics, described = robot_parameters.joint_topics(of_robots), robot_parameters.topics(of_robots).values()
    roles = {
        topic: ("", role) if role in transform_topics.ALL or role in joint_topics else tuple(role.split("/")[1:])
        for role, topic in by_role.items()
        if role not in recorded_topics.RESULTS and role not in described
    }
    by_transforms = any(row["input"] == topic_names.BY_TRANSFORMS for row in meshes.values())
    if not by_transforms and not of_robots and not any(kind in topic_names.POSITIONS for _, kind in roles.values()):
        raise RecordingError(
            f"{recording.path} has no vertices of the meshes {', '.join(meshes)}; its topics are "
            f"{', '.join(recording.topics) or 'none'}"
        )
    moved = [f"mesh.{name}.{key}" for name, row in meshes.items() for key in ("transform", "input") if row[key] == "tf"]
    moved += [f"robot.{name}" for name in of_robots if robot_parameters.need_transforms({name: of_robots[name]})]
    if moved and not any(kind in transform_topics.ALL for _, kind in roles.values()):
        raise RecordingError(
            f"{recording.path}: a mesh was moved by transforms (parameter {moved[0]}), and the recording has none: "
            "its positions cannot be computed again"
        )
    for topic in joint_topics:
        if topic not in by_role:
            raise RecordingError(
                f"{recording.path}: the recording has no joint states of {topic}, which moved robot "
                f"{', '.join(joint_topics[topic])}"
            )
    robots = recorded_robots.of_recording(recording, of_robots, by_role)
    try:
        scene_parameters.check(settings, meshes, robots)
    except ParameterError as error:
        raise rejected(printable(f"{where}: {error}")) from error
    return ReplaySetup(
        settings,
        meshes,
        roles,
        by_role.get(topic_names.CONTACTS),
        by_role.get(topic_names.DISTANCES),
        _files(recording, meshes),
        robots,
        [by_role[role] for role in dict.fromkeys(described)],
        without_effect,
        functools.partial(recorded_robots.visual_of_recording, recording, of_robots, by_role),
    )


def _stored(recording, info) -> dict:
    stored = info.get("parameters", {})
    if stored == {}:
        raise RecordingError(
            f"{recording.path} was not written by `hpccd record`: it does not contain the node's parameters. Give "
            "them with --params FILE (the YAML file that the node was started with)"
        )
    if not isinstance(stored, dict):
        raise ParameterError(f"no names and values but a {type(stored).__name__}")
    return stored


def _by_role(recording, info, types) -> dict[str, str]:
    """Role -> topic of the recording. types: role -> type; topics of other roles were recorded beside them."""
    stored = info.get("topics", {})
    if not isinstance(stored, dict):
        raise RecordingError(f"{recording.path}: the stored topics are no names but a {type(stored).__name__}")
    stored = stored or _by_suffix(recording, types)
    found: dict[str, str] = {}
    for topic, role in stored.items():
        if topic not in recording.topics or not isinstance(role, str) or role not in types:
            continue
        type_name = recording.topics[topic].type_name
        if type_name != types[role]:
            raise RecordingError(
                f"{recording.path}: topic {topic} is stored as the node's {role}, which is {types[role]}; "
                f"it holds {type_name}"
            )
        if role in found:
            raise RecordingError(f"{recording.path}: topics {found[role]} and {topic} are both stored as {role}")
        found[role] = topic
    contacts, outside = topic_names.CONTACTS, f"/{topic_names.CONTACTS}"
    if contacts not in found and types[contacts] == getattr(recording.topics.get(outside), "type_name", None):
        found[contacts] = outside
    return found


def _by_suffix(recording, types) -> dict[str, str]:
    """Topic -> role by what a topic's name ends in; of several topics with the same role, the first."""
    by_ending = {role.removeprefix("/"): role for role in types}
    lengths = sorted({1 + ending.count("/") for ending in by_ending})
    found: dict[str, str] = {}
    for topic in recording.topics.values():
        words = topic.name.split("/")
        endings = ("/".join(words[-count:]) for count in lengths if len(words) > count)
        role = next((by_ending[ending] for ending in endings if ending in by_ending), None)
        if role is not None and types[role] == topic.type_name and role not in found.values():
            found[topic.name] = role
    return found


def _files(recording, meshes):
    found = {}
    for name, row in meshes.items():
        if not row["file"]:
            continue
        attachment = attachment_name(name, row["file"])
        try:
            if attachment in recording.attachments:
                vertices, faces = _load(attachment, recording.attachments[attachment])
            else:
                vertices, faces = load_mesh(resources.local_path(row["file"]))
            found[name] = mesh_of_file(vertices, faces, row)
        except MeshFileError as error:
            raise RecordingError(f"mesh {name} of the recording: {error}") from error
    return found


def _load(attachment, data):
    suffix = PurePosixPath(attachment).suffix
    with tempfile.TemporaryDirectory() as folder:
        # A name of our own: that of a recording may be any.
        copy = Path(folder) / f"mesh{suffix}"
        if suffix.lower() in FORMATS:
            copy.write_bytes(data)
        try:
            return load_mesh(str(copy))
        except MeshFileError as error:
            raise MeshFileError(str(error).replace(str(copy), attachment)) from error
