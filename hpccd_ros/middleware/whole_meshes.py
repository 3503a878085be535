# SPDX-License-Identifier: Apache-2.0
"""Messages of other programs with vertices and triangles at once: shape_msgs/Mesh and visualization_msgs/Marker. They
are read from their CDR bytes, in half a millisecond for a marker of 10,000 triangles. rclpy makes a Python object of
each point, which takes 56 ms, and as long again to make an array of them.
"""

import zlib
from dataclasses import dataclass

import numpy as np
from builtin_interfaces.msg import Time
from numpy.typing import NDArray
from visualization_msgs.msg import Marker

from hpccd_core.rigid.transform import Rigid
from hpccd_ros.base.quoting import counted
from hpccd_ros.frames.drops import Reason
from hpccd_ros.frames.types import Topology
from hpccd_ros.frames.welding import Welding
from hpccd_ros.middleware.fields import InvalidMessageError, stamp_to_ns
from hpccd_ros.middleware.mesh_messages import check_size, usable

# After these bytes, which are the encoding, the message begins, and with it alignment.
_HEADER = 4
_ORDERS = {b"\x00\x00": ">", b"\x00\x01": "<"}


class CdrReader:
    """data: with its header. All methods raise InvalidMessageError for invalid bytes."""

    def __init__(self, data: bytes) -> None:
        order = _ORDERS.get(bytes(data[:2]))
        if order is None or len(data) < _HEADER:
            raise _malformed(f"its bytes begin with {bytes(data[:_HEADER]).hex() or 'nothing'}, which is not plain CDR")
        self._data, self._order, self._at = data, order, _HEADER

    def numbers(self, code: str, count: int) -> NDArray:
        """``count`` numbers of numpy's type ``code``, in a new array."""
        kind = np.dtype(code)
        if count:  # an empty array is not aligned
            self._at += -(self._at - _HEADER) % kind.itemsize
        end = self._at + count * kind.itemsize
        if end > len(self._data):
            raise _malformed(f"it has {counted(len(self._data), 'byte')}, and its fields need {end} or more")
        found = np.frombuffer(self._data, kind.newbyteorder(self._order), count, self._at)
        self._at = end
        return found.astype(kind)

    def number(self, code: str) -> int:
        return int(self.numbers(code, 1)[0])

    def text(self) -> str:
        text = self.numbers("u1", self.number("u4")).tobytes()
        try:
            return text.rstrip(b"\0").decode()
        except UnicodeDecodeError as error:
            raise _malformed(f"a text in it is not UTF-8: {error}") from error


def _malformed(why: str) -> InvalidMessageError:
    return InvalidMessageError(Reason.MALFORMED, f"{why}; build its publisher with the same definition of the message")


_ACTIONS = {Marker.ADD: "ADD", Marker.DELETE: "DELETE", Marker.DELETEALL: "DELETEALL"}


@dataclass(frozen=True, eq=False)
class WholeMesh:
    """``stamp`` ns. ``vertices`` (n,3) float64."""

    stamp: int
    frame_id: str
    vertices: np.ndarray
    topology: Topology


def mesh_from_shape(data: bytes, sent: int, max_vertices: int, max_faces: int) -> WholeMesh:
    """sent: when its publisher sent it, ns, because the message has no stamp, and a recorder receives it at another
    time than the node. Raises InvalidMessageError: empty, too large, an index out of range, an invalid coordinate."""
    if sent <= 0:
        raise InvalidMessageError(
            Reason.MALFORMED,
            "its publisher sends no source timestamp, its only stamp; use another input",
        )
    reader = CdrReader(data)
    faces = reader.numbers("u4", 3 * _size("triangles", reader, "max_faces", max_faces)).reshape(-1, 3)
    vertices = reader.numbers("f8", 3 * _size("vertices", reader, "max_vertices", max_vertices)).reshape(-1, 3)
    if (highest := int(faces.max())) >= len(vertices):
        raise InvalidMessageError(
            Reason.INDEX_RANGE,
            f"triangle {int(faces.argmax()) // 3} names vertex {highest}, the mesh has "
            f"{counted(len(vertices), 'vertex', 'vertices')}",
        )
    return WholeMesh(sent, "", usable(vertices), numbered(faces, len(vertices)))


def mesh_from_marker(data: bytes, max_vertices: int, max_faces: int, welding: Welding) -> WholeMesh:
    """From a marker of type TRIANGLE_LIST: its points, transformed by its scale and then its pose. welding: that of the
    previous markers. Raises InvalidMessageError as for shapes, and for another type or action."""
    reader = CdrReader(data)
    stamp = stamp_to_ns(Time(sec=reader.number("i4"), nanosec=reader.number("u4")))
    frame_id = reader.text()
    reader.text()  # its namespace; then its id
    _, kind, action = reader.numbers("i4", 3).tolist()
    if action != Marker.ADD:
        raise InvalidMessageError(
            Reason.UNSUPPORTED_TYPE,
            f"marker with action {_ACTIONS.get(action, action)}: a mesh cannot be removed; only ADD is supported",
        )
    if kind != Marker.TRIANGLE_LIST:
        raise InvalidMessageError(
            Reason.UNSUPPORTED_TYPE, f"marker of type {kind}; only TRIANGLE_LIST ({Marker.TRIANGLE_LIST}) is a mesh"
        )
    shift, turn, scale = np.split(reader.numbers("f8", 10), [3, 7])
    if not (np.isfinite(scale).all() and scale.all()):
        raise InvalidMessageError(
            Reason.MALFORMED,
            f"scale is {scale.tolist()}; it multiplies the points: set 1 to leave them unscaled",
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
        raise InvalidMessageError(Reason.MALFORMED, f"points has {counted(len(points), 'point')}, not a multiple of 3")
    local, faces = welding.vertices_and_faces(usable(points))
    check_size("vertices", len(local), "max_vertices", max_vertices)
    # By 1 too, which changes no bit.
    return WholeMesh(stamp, frame_id, usable(pose.apply(local * scale)), numbered(faces, len(local)))


def numbered(faces: np.ndarray, n_vertices: int) -> Topology:
    """Its version is its checksum, so that it is equal for every reader of the same mesh."""
    return Topology(zlib.crc32(np.ascontiguousarray(faces), n_vertices), n_vertices, faces)


def _size(name: str, reader: CdrReader, parameter: str, limit: int) -> int:
    size = reader.number("u4")
    if not size:
        raise InvalidMessageError(Reason.MALFORMED, f"{name} is empty")
    check_size(name, size, parameter, limit)
    return size
