# SPDX-License-Identifier: Apache-2.0
"""The robots of a recording: their descriptions from its attachments or messages, and the mesh files that these
name."""

import contextlib
import tempfile
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any

from hpccd_core import MeshFileError
from hpccd_core.mesh_files.load import FORMATS
from hpccd_ros.bag.cut import seconds
from hpccd_ros.bag.decode import make_decoder
from hpccd_ros.bag.reader import Recording, RecordingError
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


def visual_of_recording(recording: Recording, robots: RobotValues, topics: Mapping[str, str]) -> dict[str, Robot]:
    """As of_recording(), but made of their visual geometry: of those for whom the description has some and its mesh
    files are there."""
    found = {}
    for name, values in robots.items():
        with contextlib.suppress(RobotError, MeshFileError):
            seen = {**values, "geometry": "visual"}
            found[name] = _robot(recording, name, seen, _descriptions(recording, name, values, topics))
    return found


def _robot(recording, name: str, values: Mapping[str, Any], texts: Mapping[str, int]) -> Robot:
    """The robot of the only text that can be used: the node rejected the others and kept this one. texts: each with the
    time, ns, at which it was first received."""
    semantics = _semantics(recording, name, values)
    robots: list[tuple[Robot, int]] = []
    rejected: RobotError | MeshFileError | None = None
    for text, came in texts.items():
        try:
            with tempfile.TemporaryDirectory() as folder:
                find = _resolver(recording, name, values, text, Path(folder))
                robots.append((robot_files.robot_of(name, values, text, semantics, find), came))
        except (RobotError, MeshFileError) as error:
            rejected = error
    if len(robots) > 1:
        at = seconds(robots[1][1] - next(recording.records()).message.log_time)
        raise RobotError(
            f"its description on {values['description']} changed {at} s after the beginning; replay the parts before "
            f"and after that: `hpccd cut {recording.path} --to {at} -o before.mcap`, "
            f"`hpccd cut {recording.path} --from {at} -o after.mcap`"
        )
    if rejected is not None and not robots:
        raise rejected
    return robots[0][0]


def _descriptions(recording, name: str, values: Mapping[str, Any], topics: Mapping[str, str]) -> dict[str, int]:
    """The descriptions, at least one, each with the time, ns, at which it was first received."""
    description = values["description"]
    if not robot_parameters.comes_on_topic(description):
        return {_text(recording, attachments.description_name(name), description): 0}
    topic = topics.get(description)
    if topic is None or not recording.topics[topic].count:
        raise RobotError(f"its description came on {description}, of which the recording has no message")
    decode = make_decoder(recording.topics[topic])
    found: dict[str, int] = {}
    for message in recording.messages([topic]):
        found.setdefault(decode(message).data, message.log_time)
    return found


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
    """A copy in ``folder`` of each attached file, otherwise the file itself."""
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
