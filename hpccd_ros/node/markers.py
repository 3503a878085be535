# SPDX-License-Identifier: Apache-2.0
"""Messages for RViz and Foxglove: contacts, intersection curves and depths as markers, limited in number so that
viewers keep up, and vertices."""

from collections.abc import Sequence

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from hpccd_core.picture.lines import Depth
from hpccd_ros.detect.plane_patch import FACES as PATCH_FACES
from hpccd_ros.detect.plane_patch import patch
from hpccd_ros.detect.scene import PlaneSettings
from hpccd_ros.middleware import fields

# Colour-blind safe pair (Okabe and Ito): vertex-face orange, edge-edge blue.
_VERTEX_FACE = ColorRGBA(r=0.90, g=0.62, b=0.0, a=1.0)
_EDGE_EDGE = ColorRGBA(r=0.0, g=0.45, b=0.70, a=1.0)
# From the same palette: sky blue.
_NEAR = ColorRGBA(r=0.34, g=0.71, b=0.91, a=1.0)
# Vermillion, and reddish purple.
_INTERSECTION = ColorRGBA(r=0.84, g=0.37, b=0.0, a=1.0)
_DEPTH = ColorRGBA(r=0.80, g=0.47, b=0.65, a=1.0)
# Grey, translucent: planes are beneath everything.
_PLANE = ColorRGBA(r=0.6, g=0.6, b=0.6, a=0.4)
_NORMAL_LENGTH = 10.0  # in point diameters


def contact_markers(
    points: np.ndarray,
    normals: np.ndarray,
    closest: np.ndarray,
    n_vertex_face: int,
    *,
    stamp: Time,
    frame_id: str,
    size: float,
    limit: int,
) -> MarkerArray:
    """Always four markers, so that old ones disappear: vertex-face, edge-edge and other kinds (points), normals, and
    connections of near pairs (lines).

    points, normals: (N,3), the first ``n_vertex_face`` of vertex-face contacts. closest: (N,2,3) nearest points of both
    sides, or (0,2,3) where nothing is to stay apart. limit: most contacts drawn, taken evenly from the whole list.
    """
    chosen = np.arange(len(points))
    if len(points) > limit:
        chosen = np.linspace(0, len(points) - 1, limit).astype(np.int64)
    is_vf = chosen < n_vertex_face
    at = points[chosen]
    tips = at + _NORMAL_LENGTH * size * normals[chosen]
    lines = np.stack([at, tips], axis=1).reshape(-1, 3)
    spheres = [
        _marker(i, name, Marker.POINTS, stamp, frame_id, size, colour, at[mask])
        for i, (name, colour, mask) in enumerate(
            [("vertex_face", _VERTEX_FACE, is_vf), ("edge_edge", _EDGE_EDGE, ~is_vf)]
        )
    ]
    normal = _marker(
        2, "normals", Marker.LINE_LIST, stamp, frame_id, 0.2 * size, ColorRGBA(r=0.3, g=0.3, b=0.3, a=1.0), lines
    )
    gaps = (closest[chosen] if len(closest) else closest).reshape(-1, 3)
    near = _marker(3, "near", Marker.LINE_LIST, stamp, frame_id, 0.2 * size, _NEAR, gaps)
    return MarkerArray(markers=[*spheres, normal, near])


def intersection_marker(lines: Sequence[np.ndarray], *, stamp: Time, frame_id: str, size: float) -> Marker:
    """lines: (n,3) each, the points of a polyline. Without any, it deletes the last one."""
    ends = [np.repeat(line, 2, axis=0)[1:-1] for line in lines]
    points = np.concatenate(ends) if ends else np.empty((0, 3))
    return _marker(4, "intersections", Marker.LINE_LIST, stamp, frame_id, 0.3 * size, _INTERSECTION, points)


def depth_markers(depths: Sequence[Depth], *, stamp: Time, frame_id: str, size: float, count: int) -> list[Marker]:
    """An arrow for each depth, numbered from 0, from its start to its end. count: how many markers are made at least;
    those without a depth delete the arrows of that number."""
    markers = []
    for number in range(max(len(depths), count)):
        ends = np.stack([depths[number].start, depths[number].end]) if number < len(depths) else np.empty((0, 3))
        marker = _marker(number, "depth", Marker.ARROW, stamp, frame_id, 0.4 * size, _DEPTH, ends)
        # Diameters of shaft and head; the head is not longer than half of a short arrow.
        marker.scale.y = size
        marker.scale.z = min(1.5 * size, 0.5 * depths[number].length) if len(ends) else 0.0
        markers.append(marker)
    return markers


def plane_markers(
    planes: Sequence[PlaneSettings], vertices: Sequence[np.ndarray], *, stamp: Time, frame_id: str
) -> list[Marker]:
    """A patch of each plane beneath the meshes; a marker without points deletes that of a plane far away."""
    markers = []
    for number, plane in enumerate(planes):
        corners = patch(plane, vertices)
        points = np.empty((0, 3)) if corners is None else corners[PATCH_FACES.reshape(-1)]
        marker = _marker(number, "planes", Marker.TRIANGLE_LIST, stamp, frame_id, 1.0, _PLANE, points)
        marker.scale.z = 1.0  # coordinates are multiplied by it
        markers.append(marker)
    return markers


def surface_cloud(vertices: Sequence[np.ndarray], header: Header) -> PointCloud2:
    """All vertices of all meshes, (n,3) each; fields x y z FLOAT32 and mesh UINT32, the number of the mesh.

    Triangles would be drawn nicer, but markers hold them point by point: 0.3 s for 90,000 triangles.
    """
    counts = [len(part) for part in vertices]
    cloud = np.empty(sum(counts), [("xyz", np.float32, 3), ("mesh", np.uint32)])
    np.concatenate(vertices, out=cloud["xyz"], casting="same_kind")
    cloud["mesh"] = np.repeat(np.arange(len(counts), dtype=np.uint32), counts)
    step = cloud.dtype.itemsize
    out = PointCloud2(header=header, height=1, width=len(cloud), point_step=step, row_step=step * len(cloud))
    out.fields = [PointField(name=n, offset=4 * i, datatype=PointField.FLOAT32, count=1) for i, n in enumerate("xyz")]
    out.fields.append(PointField(name="mesh", offset=12, datatype=PointField.UINT32, count=1))
    out.is_dense = True
    out.data = fields.to_field(cloud.view(np.uint8))
    return out


def _marker(
    identity: int,
    namespace: str,
    kind: int,
    stamp: Time,
    frame_id: str,
    size: float,
    colour: ColorRGBA,
    points: np.ndarray,
) -> Marker:
    # An empty list of points is an error in RViz: delete the marker instead.
    marker = Marker(ns=namespace, id=identity, type=kind, action=Marker.ADD if len(points) else Marker.DELETE)
    marker.header.stamp = stamp
    marker.header.frame_id = frame_id
    marker.pose.orientation.w = 1.0
    marker.scale.x = marker.scale.y = size
    marker.color = colour
    marker.points = [Point(x=x, y=y, z=z) for x, y, z in points.tolist()]
    return marker
