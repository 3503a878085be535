# SPDX-License-Identifier: Apache-2.0
"""Files attached to a recording: without them a replay elsewhere could not rebuild the scene."""

import hashlib
import itertools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hpccd_core import MeshFileError
from hpccd_core.mesh_files.load import existing
from hpccd_ros.base.quoting import shortened
from hpccd_ros.middleware import robot_files
from hpccd_ros.params import robot_parameters
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.xml_tree import decoded

# Limit for a description: far more than robots have.
MOST_FILES = 1000

Files = list[tuple[str, bytes]]


def attachment_name(mesh: str, path: str) -> str:
    """Name of the attachment with the file `path` of a mesh; its suffix is the format."""
    return f"mesh/{mesh}/{Path(path).name}"


def description_name(robot: str) -> str:
    return f"robot/{robot}/description.urdf"


def semantics_name(robot: str) -> str:
    return f"robot/{robot}/semantics.srdf"


def link_mesh_name(robot: str, uri: str) -> str:
    """Name of the attachment with a mesh file that the robot's description names."""
    return f"robot/{robot}/mesh/{_digest(uri)}/{Path(uri).name}"


def changed_link_mesh_name(name: str, description: str) -> str:
    """Replaces the ``name`` of a mesh file that has changed since an earlier description named it."""
    folder, _, file = name.rpartition("/")
    return f"{folder}/{_digest(description)}/{file}"


def files(parameters: dict) -> tuple[Files, list[str]]:
    """([(attachment name, content)] of the files that the node's parameters name, [errors of unreadable ones])."""
    found: Files = []
    missing: list[str] = []
    for mesh in parameters["meshes"] or []:  # None: never set
        if path := parameters.get(f"mesh.{mesh}.file"):
            _read(f"mesh file {path}", attachment_name(mesh, path), path, found, missing)
    for robot, values in robot_parameters.of(parameters).items():
        if path := values["srdf"]:
            _read(f"SRDF {path}", semantics_name(robot), path, found, missing)
        path = values["description"]
        if not robot_parameters.comes_on_topic(path):
            _read(f"URDF {path}", description_name(robot), path, found, missing)
            data = next((data for name, data in found if name == description_name(robot)), b"")
            of_links, unread = _named_by(robot, values, data)
            found += of_links
            missing += unread
    return found, missing


def _named_by(robot: str, values: Mapping[str, Any], data: bytes) -> tuple[Files, list[str]]:
    """`link_meshes` for the description in a file."""
    try:
        return link_meshes(robot, values, decoded(data))
    except RobotError:
        return [], []  # the node has no such robot either, and says why


def link_meshes(robot: str, values: Mapping[str, Any], text: str) -> tuple[Files, list[str]]:
    """As `files`, for the files that the description ``text`` names. values: parameters robot.NAME.*."""
    found: Files = []
    missing: list[str] = []
    path = values["description"]
    try:
        find = robot_files.resolver(None if robot_parameters.comes_on_topic(path) else path)
        uris = list(itertools.islice(robot_files.mesh_uris(text, values["geometry"]), MOST_FILES + 1))
    except (RobotError, MeshFileError):
        return [], []  # the node has no such robot either, and says why
    for number, uri in enumerate(uris):
        if number == MOST_FILES:
            missing.append(f"robot {robot} names more than {MOST_FILES} mesh files: only these are in the recording")
            break
        try:
            file = str(existing(find(uri)))  # in an untrusted description: only mesh files, no devices
        except MeshFileError as error:
            missing.append(_missing(f"mesh file {shortened(uri)}", error))
            continue
        _read(f"mesh file {shortened(uri)}", link_mesh_name(robot, uri), file, found, missing)
    return found, missing


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:16]


def _read(what: str, name: str, path: str, found: Files, missing: list[str]) -> None:
    try:
        found.append((name, robot_files.path_of(path).read_bytes()))
    except (OSError, ValueError) as error:
        missing.append(_missing(what, error.strerror if isinstance(error, OSError) else error))


def _missing(what: str, why: object) -> str:
    return f"{what} is not in the recording ({why}): a replay will need it at that place"
