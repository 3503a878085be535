# SPDX-License-Identifier: Apache-2.0
"""Meshes as shape_msgs/Mesh and as markers of triangles."""

import numpy as np
from geometry_msgs.msg import Point
from shape_msgs.msg import Mesh, MeshTriangle
from visualization_msgs.msg import Marker

from hpccd_ros.middleware import fields


def shape_of(vertices, faces):
    triangles = [MeshTriangle(vertex_indices=np.asarray(face, np.uint32)) for face in faces]
    return Mesh(vertices=_points(vertices), triangles=triangles)


def marker_of(vertices, faces, stamp=0, frame_id=""):
    """Without shared vertices: each triangle has three points."""
    message = Marker(type=Marker.TRIANGLE_LIST, action=Marker.ADD, points=_points(vertices[faces.reshape(-1)]))
    message.header.stamp, message.header.frame_id = fields.ns_to_stamp(stamp), frame_id
    message.scale.x = message.scale.y = message.scale.z = 1.0
    return message


def _points(vertices):
    return [Point(x=x, y=y, z=z) for x, y, z in np.asarray(vertices, np.float64).tolist()]
