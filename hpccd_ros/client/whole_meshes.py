# SPDX-License-Identifier: Apache-2.0
"""Meshes that come as shape_msgs/Mesh or as markers of triangles, in the numbering of the node: contacts name its
vertices and faces."""

from typing import Any

from numpy.typing import NDArray
from rclpy.serialization import serialize_message
from shape_msgs.msg import Mesh
from visualization_msgs.msg import Marker

from hpccd_ros.frames.types import Topology
from hpccd_ros.frames.welding import Welding
from hpccd_ros.middleware import whole_meshes

_ANY = 2**31 - 1


def mesh_from_shape(message: Mesh) -> tuple[Topology, NDArray[Any]]:
    """Topology and (n, 3) float64 vertices of a message for ``mesh.NAME.input: shape``, numbered as they are in it.

    Raises ValueError for one that the node refuses.
    """
    mesh = whole_meshes.mesh_from_shape(serialize_message(message), 1, _ANY, _ANY)
    return mesh.topology, mesh.vertices


def mesh_from_marker(message: Marker, welding: Welding | None = None) -> tuple[Topology, NDArray[Any]]:
    """Topology and (n, 3) float64 vertices of a message for ``mesh.NAME.input: marker``, scaled and placed.

    Faces are numbered as the triangles of the message; vertices in the order in which their points first come, as equal
    points are one vertex. welding: of the markers that were sent before it; the node keeps what the first of a stream
    joins, as long as it stays together. None: this is the first.
    Raises ValueError for one that the node refuses.
    """
    data = serialize_message(message)
    mesh = whole_meshes.mesh_from_marker(data, _ANY, _ANY, Welding() if welding is None else welding)
    return mesh.topology, mesh.vertices
