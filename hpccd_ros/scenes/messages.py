# SPDX-License-Identifier: Apache-2.0
"""A scene as the ROS messages that play it: what is sent, in which order, with which stamps and versions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from hpccd_ros.middleware import topic_names

from . import cdr
from .scene import Frame, Scene


@dataclass(frozen=True)
class Message:
    topic: str
    stamp_ns: int
    data: bytes  # CDR


class Player:
    """Turns frames into messages and counts topology versions on over repetitions of the scene.

    Each repetition begins with a new version of each moving mesh's topology, so that no receiver takes the jump
    from the last frame back to the first for a motion.
    """

    def __init__(self, scene: Scene, frame_id: str = "world"):
        self._scene, self._frame_id = scene, frame_id
        self._base = {mesh.name: -1 for mesh in scene.meshes}
        self._version = dict(self._base)
        self._step = 0

    def version(self, mesh: str) -> int:
        """Version of the mesh's topology in the messages so far; -1 before the first."""
        return self._version[mesh]

    def messages(self, frame: Frame, stamp_ns: int) -> Iterator[Message]:
        """Messages of one frame, stamped `stamp_ns`: topologies that change, then vertices, static meshes first."""
        for mesh in self._scene.meshes:
            change = frame.topologies.get(mesh.name)
            if frame.index == 0 and not (mesh.static and self._step):
                self._base[mesh.name] = self._version[mesh.name] + 1
                faces, n_vertices, version = mesh.faces, mesh.n_vertices, 0
            elif change:
                faces, n_vertices, version = change.faces, change.n_vertices, change.version
            else:
                continue
            self._version[mesh.name] = self._base[mesh.name] + version
            data = cdr.topology(stamp_ns, self._frame_id, self._version[mesh.name], faces, n_vertices)
            yield Message(topic_names.topology(mesh.name), stamp_ns, data)
        meshes = zip(self._scene.meshes, frame, strict=True)
        for mesh, xyz in sorted(meshes, key=lambda pair: not pair[0].static):
            data = cdr.vertices(stamp_ns, self._frame_id, self._version[mesh.name], self._step, xyz)
            yield Message(topic_names.vertices(mesh.name), stamp_ns, data)
        self._step += 1


def node_parameters(scene: Scene) -> dict[str, object]:
    """Parameters that make an hpccd node listen to this scene, by their full names."""
    parameters: dict[str, object] = {"meshes": scene.mesh_names}
    for mesh in scene.meshes:
        parameters[f"mesh.{mesh.name}.static"] = mesh.static
        parameters[f"mesh.{mesh.name}.self_collision"] = mesh.self_collision
    return parameters
