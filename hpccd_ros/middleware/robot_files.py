# SPDX-License-Identifier: Apache-2.0
"""A robot from its description and the files that it names."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from hpccd_core import MeshFileError
from hpccd_ros.base.quoting import shortened
from hpccd_ros.detect.core import unusable_topology
from hpccd_ros.middleware import resources
from hpccd_ros.robots import urdf
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.geometry import Resolver, beside
from hpccd_ros.robots.robot import Robot
from hpccd_ros.robots.shapes import MeshFile
from hpccd_ros.robots.xml_tree import MOST_CHARACTERS, decoded

# Characters have at most four bytes.
_MOST_BYTES = 4 * MOST_CHARACTERS


def text_of(resource: str) -> str:
    """The text of a file: a path, package:// or file://. Raises RobotError."""
    try:
        with open(path := path_of(resource), "rb") as file:
            data = file.read(_MOST_BYTES + 1)
    except FileNotFoundError as error:
        remedy = "correct the path" + ("" if path.is_absolute() else f", which starts at {Path.cwd()}")
        raise RobotError(f"{shortened(resource)}: no such file; {remedy}") from error
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise RobotError(f"{shortened(resource)}: cannot be read: {why}") from error
    if len(data) > _MOST_BYTES:
        raise RobotError(f"{shortened(resource)}: has more than {_MOST_BYTES} bytes; give a smaller file")
    try:
        return decoded(data)
    except RobotError as error:
        raise RobotError(f"{shortened(resource)}: {error}") from error


def path_of(resource: str) -> Path:
    """Raises MeshFileError."""
    try:
        return Path(resources.local_path(resource)).expanduser()
    except RuntimeError as error:  # ~name, and there is no such user
        raise MeshFileError(f"{shortened(resource)}: no such home folder; give the whole path") from error


def resolver(description: str | None) -> Resolver:
    """The resolver for mesh files of a description. description: its file, in whose folder relative names start; None:
    it came on a topic."""
    if description is None:
        return resources.local_path
    return beside(path_of(description).absolute().parent, resources.local_path)


def robot_of(name: str, values: Mapping[str, Any], text: str, semantics: str | None, find: Resolver) -> Robot:
    """values: parameters robot.NAME.*. text, semantics: URDF and SRDF. Raises RobotError."""
    robot = Robot.of(text, semantics, values["geometry"], find, name=name, tolerance=values["tolerance"])
    for mesh in robot.meshes:
        if why := unusable_topology(mesh.topology):
            raise RobotError(f"link {mesh.link}: {why}")
    return robot


def mesh_uris(text: str, geometry: str) -> Iterator[str]:
    """The mesh files that a description names, each once, in its order. Raises RobotError."""
    shapes = (part.shape for link in urdf.parse(text, geometry).links for part in link.geometry)
    yield from dict.fromkeys(shape.uri for shape in shapes if isinstance(shape, MeshFile))
