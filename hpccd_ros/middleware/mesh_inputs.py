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


def read(
    kind: str, message: Any, limits: dict[str, Any], received: float = 0.0, only_publisher: bool = True
) -> Topology | MeshFrame:
    """Arrays of the frame are views of the message's bytes where it allows that.

    limits: max_vertices, max_faces, max_edges. received, only_publisher: of the frame, as in `MeshFrame`.
    Raises InvalidMessageError.
    """
    if kind == TOPOLOGY:
        return mesh_messages.topology_from_message(message, limits)
    stamp, frame_id = fields.stamp_to_ns(message.header.stamp), message.header.frame_id
    if kind == VERTICES:
        vertices = mesh_messages.vertices_from_message(message, limits["max_vertices"])
        version, step = message.topology_version, message.step
    else:
        vertices = mesh_messages.vertices_from_cloud(message, limits["max_vertices"])
        version = step = None  # a cloud tells neither
    return MeshFrame(stamp, vertices, version, step, frame_id, received, only_publisher)
