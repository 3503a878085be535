# SPDX-License-Identifier: Apache-2.0
"""Inputs of a mesh by the last part of their topic: messages -> checked topologies and frames."""

from dataclasses import replace
from typing import Any

from geometry_msgs.msg import PoseStamped
from hpccd.msg import MeshTopology, MeshVertices
from sensor_msgs.msg import PointCloud2
from shape_msgs.msg import Mesh
from visualization_msgs.msg import Marker

from hpccd_ros.frames.drops import Input
from hpccd_ros.frames.types import MeshFrame, PoseFrame, Topology
from hpccd_ros.frames.welding import Welding
from hpccd_ros.middleware import fields, mesh_messages, message_types, whole_meshes
from hpccd_ros.middleware.topic_names import MARKER, POINTS, POSE, POSITIONS, SHAPE, TOPOLOGY, VERTICES, WHOLE

TYPES = {
    TOPOLOGY: MeshTopology,
    VERTICES: MeshVertices,
    POINTS: PointCloud2,
    SHAPE: Mesh,
    MARKER: Marker,
    POSE: PoseStamped,
}
TYPE_NAMES = {
    TOPOLOGY: message_types.TOPOLOGY,
    VERTICES: message_types.VERTICES,
    POINTS: message_types.POINTS,
    SHAPE: message_types.SHAPE,
    MARKER: message_types.MARKER,
    POSE: message_types.POSE,
}
INPUTS = {TOPOLOGY: Input.TOPOLOGY} | dict.fromkeys(POSITIONS, Input.VERTICES)


def read(
    kind: str,
    message: Any,
    limits: dict[str, Any],
    received: float = 0.0,
    only_publisher: bool = True,
    *,
    sent: int = 0,
    welding: Welding | None = None,
) -> Topology | MeshFrame | PoseFrame:
    """Arrays of the frame are views of the message's bytes where it allows that.

    message: its CDR bytes where the kind is one of topic_names.WHOLE. limits: max_vertices, max_faces, max_edges.
    received, only_publisher: of the frame, as in `MeshFrame`. sent: when its publisher sent it, ns of the system clock;
    the stamp, too, of a message that has none. welding: of the markers of this mesh. Raises InvalidMessageError.
    """
    most = limits["max_vertices"], limits["max_faces"]
    if kind == TOPOLOGY:
        return replace(mesh_messages.topology_from_message(message, limits), sent=sent)
    if kind in WHOLE:
        if kind == SHAPE:
            mesh = whole_meshes.mesh_from_shape(message, sent, *most)
        else:
            mesh = whole_meshes.mesh_from_marker(message, *most, welding or Welding())
        topology = replace(mesh.topology, sent=sent)
        return MeshFrame(
            mesh.stamp,
            mesh.vertices,
            topology.version,
            None,
            mesh.frame_id,
            received,
            only_publisher,
            topology,
            sent=sent,
        )
    stamp, frame_id = fields.stamp_to_ns(message.header.stamp), message.header.frame_id
    if kind == POSE:
        return PoseFrame(stamp, mesh_messages.pose_from_message(message), frame_id, received, only_publisher, sent)
    if kind == VERTICES:
        vertices = mesh_messages.vertices_from_message(message, limits["max_vertices"])
        version, step = message.topology_version, message.step
    else:
        vertices = mesh_messages.vertices_from_cloud(message, limits["max_vertices"])
        version = step = None  # a cloud tells neither
    return MeshFrame(stamp, vertices, version, step, frame_id, received, only_publisher, sent=sent)
