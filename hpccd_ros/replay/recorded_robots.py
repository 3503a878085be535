# SPDX-License-Identifier: Apache-2.0
"""The robots of a recording: their descriptions from its attachments or messages, and the mesh files that these
name."""

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from hpccd_ros.bag.decode import make_decoder
from hpccd_ros.bag.reader import Recording, RecordingError
from hpccd_ros.frames.mesh_file import FORMATS, MeshFileError
from hpccd_ros.middleware import robot_files
from hpccd_ros.params import robot_parameters
from hpccd_ros.params.robot_parameters import RobotValues
from hpccd_ros.record import attachments
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.geometry import Resolver
from hpccd_ros.robots.robot import Robot
from hpccd_ros.robots.xml_tree import decoded


def of_recording(recording: Recording, robots: RobotValues, topics: Mapping[str, str]) -> dict[str, Robot]:
    """topics: of the recording, by the name that the parameters have. Raises RecordingError."""
    found = {}
    for name, values in robots.items():
        try:
            found[name] = _robot(recording, name, values, _descriptions(recording, name, values, topics))
        except (RobotError, MeshFileError) as error:
            raise RecordingError(f"{recording.path}: robot {name}: {error}") from error
    return found


def _robot(recording, name: str, values: Mapping[str, Any], texts: Sequence[str]) -> Robot:
    """Of the only text that can be used: the node refused the others and kept to it."""
    semantics = _semantics(recording, name, values)
    robots: list[Robot] = []
    refused: RobotError | MeshFileError | None = None
    for text in texts:
        try:
            with tempfile.TemporaryDirectory() as folder:
                find = _resolver(recording, name, values, text, Path(folder))
                robots.append(robot_files.robot_of(name, values, text, semantics, find))
        except (RobotError, MeshFileError) as error:
            refused = error
    if len(robots) > 1:
        raise RobotError(
            f"its description on {values['description']} changed while it was recorded; only the parts before and "
            "after can be computed again: cut the recording in two"
        )
    if refused is not None and not robots:
        raise refused
    return robots[0]


def _descriptions(recording, name: str, values: Mapping[str, Any], topics: Mapping[str, str]) -> list[str]:
    """At least one, each once."""
    description = values["description"]
    if not robot_parameters.comes_on_topic(description):
        return [_text(recording, attachments.description_name(name), description)]
    topic = topics.get(description)
    if topic is None or not recording.topics[topic].count:
        raise RobotError(f"its description came on {description}, of which the recording has no message")
    decode = make_decoder(recording.topics[topic])
    return list(dict.fromkeys(decode(message).data for message in recording.messages([topic])))


def _semantics(recording, name: str, values: Mapping[str, Any]) -> str | None:
    return _text(recording, attachments.semantics_name(name), values["srdf"]) if values["srdf"] else None


def _text(recording, attachment: str, path: str) -> str:
    if attachment not in recording.attachments:
        return robot_files.text_of(path)
    try:
        return decoded(recording.attachments[attachment])
    except RobotError as error:
        raise RobotError(f"{attachment}: {error}") from error


def _resolver(recording, name: str, values: Mapping[str, Any], text: str, folder: Path) -> Resolver:
    """Of what is attached a copy in ``folder``, of all else the file itself."""
    description = values["description"]
    otherwise = robot_files.resolver(None if robot_parameters.comes_on_topic(description) else description)

    def find(uri: str) -> str:
        attached = attachments.link_mesh_name(name, uri)
        changed = attachments.changed_link_mesh_name(attached, text)
        data = recording.attachments.get(changed, recording.attachments.get(attached))
        if data is None:
            return otherwise(uri)
        # A name of our own: that of a recording may be any.
        suffix = PurePosixPath(uri).suffix
        copy = folder / f"mesh{suffix if suffix.lower() in FORMATS else ''}"
        copy.write_bytes(data)
        return str(copy)

    return find
