# SPDX-License-Identifier: Apache-2.0
"""Converts messages with topologies and vertices of a mesh to checked numpy arrays, and back."""

import array
from collections.abc import Mapping

import numpy as np
from geometry_msgs.msg import PoseStamped
from hpccd.msg import MeshTopology, MeshVertices
from sensor_msgs.msg import PointCloud2, PointField

from hpccd_core.rigid.transform import Rigid
from hpccd_ros.base.quoting import counted, listed
from hpccd_ros.frames.coordinates import unusable_coordinates
from hpccd_ros.frames.drops import Reason
from hpccd_ros.frames.types import NO_EDGES, Topology
from hpccd_ros.middleware.fields import InvalidMessageError, ns_to_stamp, stamp_to_ns, to_field

_FIELD_TYPES = {PointField.FLOAT32: np.dtype(np.float32), PointField.FLOAT64: np.dtype(np.float64)}


def topology_from_message(message: MeshTopology, limits: Mapping[str, int]) -> Topology:
    """Checked topology; ``faces`` (F,3) and ``edges`` (E,2) uint32 are views of the message's bytes.

    limits: max_vertices, max_faces, max_edges.
    Raises InvalidMessageError: too large, no triples or pairs, an index out of range, an invalid stamp.
    """
    stamp_to_ns(message.header.stamp)  # not used, but invalid
    faces = _features("faces", message.faces, 3, limits)
    edges = _features("edges", message.edges, 2, limits)
    check_size("n_vertices", message.n_vertices, "max_vertices", limits["max_vertices"])
    for what, indices in (("face", faces), ("edge", edges)):
        if len(indices) and (highest := int(indices.max())) >= message.n_vertices:
            number = int(indices.argmax()) // indices.shape[1]
            raise InvalidMessageError(
                Reason.INDEX_RANGE, f"{what} {number} names vertex {highest}, n_vertices is {message.n_vertices}"
            )
    return Topology(message.version, message.n_vertices, faces, edges)


def _features(field: str, indices: array.array, corners: int, limits: Mapping[str, int]) -> np.ndarray:
    flat = np.frombuffer(indices, np.uint32)
    if len(flat) % corners:
        raise InvalidMessageError(
            Reason.MALFORMED, f"{field} has {counted(len(flat), 'index', 'indices')}, not a multiple of {corners}"
        )
    check_size(field, len(flat) // corners, f"max_{field}", limits[f"max_{field}"])
    return flat.reshape(-1, corners)


def vertices_from_message(message: MeshVertices, max_vertices: int) -> np.ndarray:
    """(n,3) float32 or float64: a view of the message's bytes.

    Raises InvalidMessageError: none or both of the arrays filled, no triples, too large, NaN, infinity or beyond 1e150.
    """
    single, double = message.vertices_f32, message.vertices_f64
    if bool(len(single)) == bool(len(double)):
        which = "both are filled" if len(single) else "both are empty"
        raise InvalidMessageError(Reason.MALFORMED, f"fill exactly one of vertices_f32 and vertices_f64; {which}")
    flat = np.frombuffer(single, np.float32) if len(single) else np.frombuffer(double, np.float64)
    if len(flat) % 3:
        raise InvalidMessageError(
            Reason.MALFORMED, f"vertices has {counted(len(flat), 'coordinate')}, not a multiple of 3"
        )
    check_size("vertices", len(flat) // 3, "max_vertices", max_vertices)
    return usable(flat.reshape(-1, 3))


def vertices_from_cloud(cloud: PointCloud2, max_vertices: int) -> np.ndarray:
    """(n,3) float32 or float64 from the fields x, y, z of a PointCloud2, n = width * height.

    A view if x, y, z fill the points without gaps, else a copy. Fields may come in any order, with
    padding within points and rows; x, y, z of both types become float64 (exactly).
    Raises InvalidMessageError: big-endian, fields missing or of another type or out of bounds, too little
    data, too large, NaN, infinity or beyond 1e150.
    """
    if cloud.is_bigendian:
        raise InvalidMessageError(
            Reason.BIG_ENDIAN, "big-endian clouds are not supported; swap the bytes and set is_bigendian to false"
        )
    offsets, types = zip(*(_cloud_field(cloud, axis) for axis in "xyz"), strict=True)
    count = cloud.width * cloud.height
    check_size("width * height", count, "max_vertices", max_vertices)
    row_bytes = cloud.width * cloud.point_step
    # A cloud with one row may leave row_step at 0, because there is no second row.
    row_step = cloud.row_step if cloud.height > 1 else max(cloud.row_step, row_bytes)
    if row_step < row_bytes:
        raise InvalidMessageError(
            Reason.MALFORMED, f"row_step {row_step} is less than width * point_step = {row_bytes}"
        )
    needed = row_step * (cloud.height - 1) + row_bytes if count else 0
    if len(cloud.data) < needed:
        raise InvalidMessageError(
            Reason.MALFORMED,
            f"data has {counted(len(cloud.data), 'byte')}, {counted(cloud.height, 'row')} of "
            f"{counted(cloud.width, 'point')} need {needed}",
        )
    if count == 0:
        raise InvalidMessageError(Reason.MALFORMED, "the cloud has no points")
    data = np.frombuffer(cloud.data, np.uint8, needed)
    size = types[0].itemsize
    if (
        len(set(types)) == 1
        and offsets == (0, size, 2 * size)
        and cloud.point_step == 3 * size
        and (row_step == row_bytes or cloud.height == 1)
    ):
        return usable(data.view(types[0]).reshape(-1, 3))
    point = np.dtype({"names": list("xyz"), "formats": types, "offsets": offsets, "itemsize": cloud.point_step})
    rows = np.ndarray((cloud.height, cloud.width), point, data, strides=(row_step, cloud.point_step))
    points = np.empty((cloud.height, cloud.width, 3), np.result_type(*types))
    for axis, name in enumerate("xyz"):
        points[..., axis] = rows[name]
    return usable(points.reshape(-1, 3))


def pose_from_message(message: PoseStamped) -> Rigid:
    """Raises InvalidMessageError: not finite, or a quaternion whose length is not 1."""
    place, turn = message.pose.position, message.pose.orientation
    try:
        return Rigid.of((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))
    except ValueError as error:
        raise InvalidMessageError(Reason.MALFORMED, f"pose: {error}") from error


def _cloud_field(cloud: PointCloud2, axis: str) -> tuple[int, np.dtype]:
    field = next((f for f in cloud.fields if f.name == axis), None)
    if field is None:
        raise InvalidMessageError(
            Reason.MALFORMED, f"no field {axis!r}; the cloud has {listed(f.name for f in cloud.fields) or 'none'}"
        )
    if field.datatype not in _FIELD_TYPES or field.count > 1:
        raise InvalidMessageError(
            Reason.UNSUPPORTED_TYPE,
            f"field {axis!r} has datatype {field.datatype} and count "
            f"{field.count}; use FLOAT32 (7) or FLOAT64 (8) and count 1",
        )
    kind = _FIELD_TYPES[field.datatype]
    if field.offset + kind.itemsize > cloud.point_step:
        raise InvalidMessageError(
            Reason.MALFORMED,
            f"field {axis!r} ends at byte {field.offset + kind.itemsize}, point_step is {cloud.point_step}",
        )
    return field.offset, kind


def check_size(what: str, size: int, parameter: str, limit: int) -> None:
    """Raises InvalidMessageError above the limit."""
    if size > limit:
        raise InvalidMessageError(
            Reason.TOO_LARGE, f"{what} is {size}, above the limit {limit} (parameter {parameter})"
        )


def usable(vertices: np.ndarray) -> np.ndarray:
    """Returns ``vertices``. Raises InvalidMessageError: NaN, infinity or beyond 1e150."""
    if problem := unusable_coordinates(vertices):
        raise InvalidMessageError(*problem)
    return vertices


def topology_message(
    faces: np.ndarray, n_vertices: int, *, edges: np.ndarray = NO_EDGES, version: int = 0, stamp_ns: int = 0
) -> MeshTopology:
    """faces: (F,3) integers, indices of the mesh's own vertices. edges: (E,2), likewise."""
    message = MeshTopology(version=version, n_vertices=n_vertices, check_fields=True)
    message.header.stamp = ns_to_stamp(stamp_ns)
    message.faces = to_field(np.asarray(faces).astype(np.uint32, copy=False))
    message.edges = to_field(np.asarray(edges).astype(np.uint32, copy=False))
    return message


def vertices_message(
    vertices: np.ndarray, stamp_ns: int, *, step: int = 0, topology_version: int = 0, frame_id: str = ""
) -> MeshVertices:
    """vertices: (n,3) float32 or float64, sent in that precision. stamp_ns: end of the step."""
    message = MeshVertices(step=step, topology_version=topology_version, check_fields=True)
    message.header.stamp = ns_to_stamp(stamp_ns)
    message.header.frame_id = frame_id
    if vertices.dtype == np.float32:
        message.vertices_f32 = to_field(vertices)
    elif vertices.dtype == np.float64:
        message.vertices_f64 = to_field(vertices)
    else:
        raise TypeError(f"vertices: dtype {vertices.dtype}; use float32 or float64")
    return message
