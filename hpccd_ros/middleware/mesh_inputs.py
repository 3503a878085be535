# SPDX-License-Identifier: Apache-2.0
"""What comes on the topics of a mesh, by the last part of their names: messages -> checked topologies and frames."""

from typing import Any

from hpccd.msg import MeshTopology, MeshVertices
from sensor_msgs.msg import PointCloud2

from hpccd_ros.frames.drops import Input
from hpccd_ros.frames.types import MeshFrame, Topology
from hpccd_ros.middleware import fields, mesh_messages
from hpccd_ros.middleware.topic_names import POINTS, TOPOLOGY, VERTICES

TYPES = {TOPOLOGY: MeshTopology, VERTICES: MeshVertices, POINTS: PointCloud2}
INPUTS = {TOPOLOGY: Input.TOPOLOGY, VERTICES: Input.VERTICES, POINTS: Input.VERTICES}


def read(kind: str, message: Any, limits: dict[str, Any], received: float = 0.0) -> Topology | MeshFrame:
    """Arrays of the frame are views of the message's bytes where it allows that.

    limits: max_vertices, max_faces. received: time.monotonic() at its arrival. Raises InvalidMessageError.
    """
    if kind == TOPOLOGY:
        return mesh_messages.topology_from_message(message, limits["max_vertices"], limits["max_faces"])
    stamp = fields.stamp_to_ns(message.header.stamp)
    if kind == VERTICES:
        vertices = mesh_messages.vertices_from_message(message, limits["max_vertices"])
        return MeshFrame(stamp, vertices, message.topology_version, message.step, message.header.frame_id, received)
    # A cloud tells neither the version of its topology nor a step.
    vertices = mesh_messages.vertices_from_cloud(message, limits["max_vertices"])
    return MeshFrame(stamp, vertices, None, None, message.header.frame_id, received)
