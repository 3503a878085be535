# SPDX-License-Identifier: Apache-2.0
"""Messages that carry vertices and triangles at once, as other programs send them: shape_msgs/Mesh and
visualization_msgs/Marker. They are read from their CDR bytes (cdr_reader.py)."""

import zlib
from dataclasses import dataclass

import numpy as np
from builtin_interfaces.msg import Time
from visualization_msgs.msg import Marker

from hpccd_ros.frames.drops import Reason
from hpccd_ros.frames.types import Topology
from hpccd_ros.frames.welding import Welding
from hpccd_ros.middleware.cdr_reader import CdrReader
from hpccd_ros.middleware.fields import InvalidMessageError, stamp_to_ns
from hpccd_ros.middleware.mesh_messages import check_size, usable
from hpccd_ros.rigid.transform import Rigid

_ACTIONS = {Marker.ADD: "ADD", Marker.DELETE: "DELETE", Marker.DELETEALL: "DELETEALL"}


@dataclass(frozen=True, eq=False)
class WholeMesh:
    """``stamp`` ns. ``vertices`` (n,3) float64."""

    stamp: int
    frame_id: str
    vertices: np.ndarray
    topology: Topology


def mesh_from_shape(data: bytes, sent: int, max_vertices: int, max_faces: int) -> WholeMesh:
    """sent: when its publisher sent it, ns: the message has no stamp, and a recorder receives it at another time than
    the node. Raises InvalidMessageError: empty, too large, an index out of range, a coordinate that is none."""
    if sent <= 0:
        raise InvalidMessageError(
            Reason.MALFORMED, "its publisher tells no time of sending, the only stamp there is; use another input"
        )
    reader = CdrReader(data)
    faces = reader.numbers("u4", 3 * _size("triangles", reader, "max_faces", max_faces)).reshape(-1, 3)
    vertices = reader.numbers("f8", 3 * _size("vertices", reader, "max_vertices", max_vertices)).reshape(-1, 3)
    if (highest := int(faces.max())) >= len(vertices):
        raise InvalidMessageError(
            Reason.INDEX_RANGE,
            f"triangle {int(faces.argmax()) // 3} names vertex {highest}, there are {len(vertices)} vertices",
        )
    return WholeMesh(sent, "", usable(vertices), numbered(faces, len(vertices)))


def mesh_from_marker(data: bytes, max_vertices: int, max_faces: int, welding: Welding) -> WholeMesh:
    """Of a marker of type TRIANGLE_LIST: its points by its scale and then its pose. welding: of the markers before it.
    Raises InvalidMessageError as for shapes, and where it is of another type or does not add a mesh."""
    reader = CdrReader(data)
    stamp = stamp_to_ns(Time(sec=reader.number("i4"), nanosec=reader.number("u4")))
    frame_id = reader.text()
    reader.text()  # its namespace; then its id
    _, kind, action = reader.numbers("i4", 3).tolist()
    if action != Marker.ADD:
        raise InvalidMessageError(
            Reason.UNSUPPORTED_TYPE,
            f"marker with action {_ACTIONS.get(action, action)}: a mesh cannot be taken away; only ADD is understood",
        )
    if kind != Marker.TRIANGLE_LIST:
        raise InvalidMessageError(
            Reason.UNSUPPORTED_TYPE, f"marker of type {kind}; only TRIANGLE_LIST ({Marker.TRIANGLE_LIST}) is a mesh"
        )
    shift, turn, scale = np.split(reader.numbers("f8", 10), [3, 7])
    if not (np.isfinite(scale).all() and scale.all()):
        raise InvalidMessageError(
            Reason.MALFORMED,
            f"scale is {scale.tolist()}; it multiplies the points: set 1 where they are not to be scaled",
        )
    try:
        pose = Rigid.of(shift, turn)
    except ValueError as error:
        raise InvalidMessageError(Reason.MALFORMED, f"pose: {error}") from error
    reader.numbers("f4", 4)  # colour
    reader.numbers("i4", 2)  # lifetime
    reader.numbers("u1", 1)  # whether it follows its frame
    points = reader.numbers("f8", 3 * _size("points", reader, "max_faces", 3 * max_faces)).reshape(-1, 3)
    if len(points) % 3:
        raise InvalidMessageError(Reason.MALFORMED, f"points has {len(points)} points, not a multiple of 3")
    local, faces = welding.vertices_and_faces(usable(points))
    check_size("vertices", len(local), "max_vertices", max_vertices)
    # By 1 too, which changes no bit: one way for all.
    return WholeMesh(stamp, frame_id, usable(pose.apply(local * scale)), numbered(faces, len(local)))


def numbered(faces: np.ndarray, n_vertices: int) -> Topology:
    """Its version is a check sum of itself: the same for whoever looks at the same mesh, whenever they began."""
    return Topology(zlib.crc32(np.ascontiguousarray(faces), n_vertices), n_vertices, faces)


def _size(name: str, reader: CdrReader, parameter: str, limit: int) -> int:
    size = reader.number("u4")
    if not size:
        raise InvalidMessageError(Reason.MALFORMED, f"{name} is empty")
    check_size(name, size, parameter, limit)
    return size
