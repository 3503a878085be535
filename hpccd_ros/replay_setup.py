# SPDX-License-Identifier: Apache-2.0
"""The scene of a recording: what the node knew from its parameters and mesh files when it was recorded."""

import dataclasses
import tempfile
from pathlib import Path

import yaml

from hpccd_ros import parameters as table
from hpccd_ros import scene_parameters, transform_topics
from hpccd_ros.detection import Options, SceneBuilder
from hpccd_ros.errors import UserError
from hpccd_ros.mcap_reader import Recording, RecordingError
from hpccd_ros.mesh_attachment import attachment_name
from hpccd_ros.mesh_file import MeshFileError, load_mesh, place
from hpccd_ros.messages import MeshFrame, Topology


@dataclasses.dataclass(frozen=True)
class ReplaySetup:
    """Node settings and mesh settings as `parameters.declare` gives them, and the topics by what they carry."""

    settings: dict
    meshes: dict[str, dict]
    # Topic name -> (mesh, "topology" | "vertices" | "points"), or ("", name in transform_topics.ALL).
    roles: dict[str, tuple[str, str]]
    contacts: str  # topic name
    files: dict[str, tuple[Topology, MeshFrame | None]]  # of meshes that come from a file; frame: static ones

    @property
    def builder(self) -> SceneBuilder:
        return scene_parameters.scene_builder(self.settings, self.meshes)

    def options(self, accuracy: str, backend: str, threads: int) -> Options:
        """Detector options of the recorded node, but for what may differ without a change of the result."""
        return Options(accuracy or self.settings["accuracy"], backend, threads, self.settings["report"])


def of_recording(recording: Recording, parameter_file: str | None = None) -> ReplaySetup:
    """Setup from what `hpccd record` stored, or from a parameter file for a recording of another recorder.

    Raises RecordingError where neither tells what the meshes are.
    """
    info = recording.info or {}
    if parameter_file:
        given = _read_parameters(parameter_file)
    elif info.get("parameters"):
        given = info["parameters"]
    else:
        raise RecordingError(
            f"{recording.path} was not written by `hpccd record`: it does not hold the node's parameters. Give "
            "them with --params FILE (the YAML file that the node was started with)"
        )
    settings = {row.name: table.normalise(row, given.get(row.name, row.default)) for row in table.NODE_ROWS}
    if not settings["meshes"]:
        raise RecordingError(f"{parameter_file or recording.path}: parameter `meshes` names no mesh")
    meshes = {
        name: {row.name: given.get(f"mesh.{name}.{row.name}", row.default) for row in table.MESH_ROWS}
        for name in settings["meshes"]
    }
    relative = info.get("topics") or _by_suffix(recording, settings["meshes"])
    roles = {}
    for topic, name in relative.items():
        first, _, rest = name.partition("/")
        if first == "meshes":
            mesh, _, kind = rest.rpartition("/")
            roles[topic] = (mesh, kind)
        elif name in transform_topics.ALL:
            roles[topic] = ("", name)
    contacts = next((topic for topic, name in relative.items() if name == "contacts"), "/contacts")
    if not any(kind in ("vertices", "points") and topic in recording.topics for topic, (_, kind) in roles.items()):
        raise RecordingError(
            f"{recording.path} holds no vertices of the meshes {', '.join(meshes)}; its topics are "
            f"{', '.join(recording.topics) or 'none'}"
        )
    moved = [name for name, row in meshes.items() if row["transform"] == "tf"]
    if moved and not any(kind in transform_topics.ALL and t in recording.topics for t, (_, kind) in roles.items()):
        raise RecordingError(
            f"{recording.path}: mesh {moved[0]} was transformed by tf (parameter mesh.{moved[0]}.transform), and the "
            "recording holds no transforms: its positions cannot be computed again"
        )
    return ReplaySetup(settings, meshes, roles, contacts, _files(recording, meshes))


def _files(recording, meshes):
    found = {}
    for name, row in meshes.items():
        if not row["file"]:
            continue
        data = recording.attachments.get(attachment_name(name, row["file"]))
        try:
            if data is None:
                vertices, faces = load_mesh(row["file"])
            else:
                with tempfile.TemporaryDirectory() as folder:
                    copy = Path(folder) / Path(row["file"]).name
                    copy.write_bytes(data)
                    vertices, faces = load_mesh(str(copy))
            frame = MeshFrame(0, place(vertices, row["pose"]), version=0) if row["static"] else None
        except MeshFileError as error:
            raise RecordingError(f"mesh {name} of the recording: {error}") from error
        found[name] = (Topology(0, len(vertices), faces), frame)
    return found


def _by_suffix(recording, meshes):
    endings = [f"meshes/{mesh}/{kind}" for mesh in meshes for kind in ("topology", "vertices", "points")]
    return {
        topic: ending
        for topic in recording.topics
        for ending in [*endings, "contacts", *transform_topics.ALL]
        if topic.endswith("/" + ending.removeprefix("/"))
    }


def _read_parameters(path) -> dict:
    """{full name: value} of a ROS parameter file, all nodes in it taken together."""
    try:
        tree = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
        sections = [section["ros__parameters"] for section in tree.values()]
    except (OSError, yaml.YAMLError, UnicodeDecodeError) as error:
        raise UserError(f"--params {path}: cannot be read: {error}") from error
    except (AttributeError, KeyError, TypeError) as error:
        raise UserError(f"--params {path}: no ROS parameter file (node name, ros__parameters, names)") from error
    flat = {}

    def walk(prefix, branch):
        for key, value in branch.items():
            if isinstance(value, dict):
                walk(f"{prefix}{key}.", value)
            else:
                flat[f"{prefix}{key}"] = value

    for section in sections:
        walk("", section)
    return flat
