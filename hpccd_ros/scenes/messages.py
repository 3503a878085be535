# SPDX-License-Identifier: Apache-2.0
"""A scene as the ROS messages that play it: what is sent, in which order, with which stamps and versions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from hpccd_ros.middleware import mesh_cdr, message_types, topic_names
from hpccd_ros.scenes.scene import Frame, Scene

# Coordinate frame of all messages of a scene.
FRAME_ID = "world"


@dataclass(frozen=True)
class SentTopic:
    """latched: the last message is in force until the next; else each is of one frame."""

    name: str
    type_name: str
    latched: bool


def topics(scene: Scene) -> list[SentTopic]:
    """All that are sent."""
    sent = []
    for mesh in scene.sent_meshes:
        sent.append(SentTopic(topic_names.topology(mesh.name), message_types.TOPOLOGY, True))
        sent.append(SentTopic(topic_names.vertices(mesh.name), message_types.VERTICES, False))
    for robot in scene.robots:
        sent.append(SentTopic(robot.description_topic, message_types.DESCRIPTION, True))
        sent.append(SentTopic(robot.joint_states_topic, message_types.JOINT_STATES, False))
    return sent


@dataclass(frozen=True)
class Message:
    topic: str
    stamp_ns: int
    data: bytes  # CDR


def first_moving(scene: Scene) -> str | None:
    """Topic of the first message of a frame that comes after what stands still; None: nothing stands still."""
    if not any(mesh.static for mesh in scene.sent_meshes):
        return None
    moving = [topic_names.vertices(mesh.name) for mesh in scene.sent_meshes if not mesh.static]
    return next(iter([*(robot.joint_states_topic for robot in scene.robots), *moving]), None)


class Player:
    """Turns frames into messages and counts topology versions on over repetitions of the scene.

    Each repetition begins with a new version of each moving mesh's topology, so that no receiver takes the jump
    from the last frame back to the first for a motion.
    """

    def __init__(self, scene: Scene, frame_id: str = FRAME_ID):
        self._scene, self._frame_id = scene, frame_id
        self._base = {mesh.name: -1 for mesh in scene.meshes}
        self._version = dict(self._base)
        self._step = 0

    def version(self, mesh: str) -> int:
        """Version of the mesh's topology in the messages so far; -1 before the first."""
        return self._version[mesh]

    def messages(self, frame: Frame, stamp_ns: int) -> Iterator[Message]:
        """Messages of one frame, stamped `stamp_ns`: topologies that change, then vertices, static meshes first.

        Of a robot its description once, and its joints between the static meshes and those that move.
        """
        for mesh in self._scene.sent_meshes:
            change = frame.topologies.get(mesh.name)
            if frame.index == 0 and not (mesh.static and self._step):
                self._base[mesh.name] = self._version[mesh.name] + 1
                faces, n_vertices, version = mesh.faces, mesh.n_vertices, 0
            elif change:
                faces, n_vertices, version = change.faces, change.n_vertices, change.version
            else:
                continue
            self._version[mesh.name] = self._base[mesh.name] + version
            data = mesh_cdr.topology(stamp_ns, self._frame_id, self._version[mesh.name], faces, n_vertices)
            yield Message(topic_names.topology(mesh.name), stamp_ns, data)
        if self._step == 0:
            for robot in self._scene.robots:
                yield Message(robot.description_topic, stamp_ns, mesh_cdr.description(robot.description))
        yield from self._vertices(frame, stamp_ns, static=True)
        for robot in self._scene.robots:
            data = mesh_cdr.joint_states(stamp_ns, robot.joint_positions(frame.time))
            yield Message(robot.joint_states_topic, stamp_ns, data)
        yield from self._vertices(frame, stamp_ns, static=False)
        self._step += 1

    def _vertices(self, frame: Frame, stamp_ns: int, static: bool) -> Iterator[Message]:
        positions = dict(zip(self._scene.mesh_names, frame, strict=True))
        for mesh in self._scene.sent_meshes:
            if mesh.static == static:
                version, xyz = self._version[mesh.name], positions[mesh.name]
                data = mesh_cdr.vertices(stamp_ns, self._frame_id, version, self._step, xyz)
                yield Message(topic_names.vertices(mesh.name), stamp_ns, data)


def node_parameters(scene: Scene) -> dict[str, object]:
    """Parameters that make an hpccd node listen to this scene, by their full names."""
    parameters: dict[str, object] = {"meshes": [mesh.name for mesh in scene.sent_meshes]}
    for mesh in scene.sent_meshes:
        parameters[f"mesh.{mesh.name}.static"] = mesh.static
        parameters[f"mesh.{mesh.name}.self_collision"] = mesh.self_collision
    if scene.robots:
        parameters["robots"] = [robot.name for robot in scene.robots]
        # A robot's links are placed in the node's frame.
        parameters["frame_id"] = FRAME_ID
    for robot in scene.robots:
        parameters[f"robot.{robot.name}.description"] = robot.description_topic
        parameters[f"robot.{robot.name}.joint_states"] = robot.joint_states_topic
        parameters[f"robot.{robot.name}.pose"] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]  # its root is the scene's frame
    known = {pair for robot in scene.robots for pair in robot.robot.ignored_pairs}
    if others := [f"{a}:{b}" for a, b in scene.ignored_pairs if (a, b) not in known]:
        parameters["ignored_pairs"] = others
    return parameters
