# SPDX-License-Identifier: Apache-2.0
"""ROS messages <-> numpy arrays, without copies where the bytes allow it. The only place that knows both.

Array fields are never assigned from numpy: rclpy's setter would walk it element by element (123 ms for 5 MB
of float32), while ``array.array`` filled from the buffer takes 0.5 ms. A message made with check_fields=True
takes such an array as it is; any other copies it once more.
"""

from array import array
from dataclasses import dataclass

import numpy as np
from builtin_interfaces.msg import Time
from hpccd.msg import ContactArray, MeshTopology, MeshVertices
from sensor_msgs.msg import PointCloud2, PointField

from hpccd_ros import coordinates
from hpccd_ros.drops import Reason
from hpccd_ros.messages import Topology
from hpccd_ros.quoting import listed

_NS = 1_000_000_000
_CODES = {
    np.dtype(np.float32): "f",
    np.dtype(np.float64): "d",
    np.dtype(np.uint32): "I",
    np.dtype(np.uint8): "B",
}
_FIELD_TYPES = {PointField.FLOAT32: np.dtype(np.float32), PointField.FLOAT64: np.dtype(np.float64)}


class InvalidMessageError(ValueError):
    """A message that cannot be used: ``reason`` for the counters, the text says what to mend."""

    def __init__(self, reason: Reason, text: str) -> None:
        super().__init__(text)
        self.reason = reason


def stamp_to_ns(stamp: Time) -> int:
    """Nanoseconds since the epoch. Raises InvalidMessageError: before it, or a whole second in nanosec."""
    if stamp.sec < 0 or stamp.nanosec >= _NS:
        raise InvalidMessageError(
            Reason.MALFORMED,
            f"stamp has sec {stamp.sec} and nanosec {stamp.nanosec}; sec must not be negative, nanosec below {_NS}",
        )
    return stamp.sec * _NS + stamp.nanosec


def ns_to_stamp(ns: int) -> Time:
    """Time message of nanoseconds since the epoch."""
    sec, nanosec = divmod(ns, _NS)
    return Time(sec=sec, nanosec=nanosec)


def to_field(values: np.ndarray) -> array:
    """``array.array`` for an array field of a message; any shape, flattened in C order.

    values: float32, float64, uint32 or uint8.
    """
    values = np.ascontiguousarray(values)
    field = array(_CODES[values.dtype])
    field.frombytes(memoryview(values).cast("B") if values.size else b"")
    return field


def _zeros(code: str, count: int) -> array:
    """A field to be written into through np.frombuffer: to_field would copy a temporary."""
    return array(code, [0]) * count


def topology_from_message(message: MeshTopology, max_vertices: int, max_faces: int) -> Topology:
    """Checked topology; ``faces`` (F,3) uint32 is a view of the message's bytes.

    Raises InvalidMessageError: too large, no triples, an index out of range, a stamp that is no time.
    """
    stamp_to_ns(message.header.stamp)  # not used, but wrong
    flat = np.frombuffer(message.faces, np.uint32)
    if len(flat) % 3:
        raise InvalidMessageError(Reason.MALFORMED, f"faces has {len(flat)} indices, not a multiple of 3")
    _limit("faces", len(flat) // 3, "max_faces", max_faces)
    _limit("n_vertices", message.n_vertices, "max_vertices", max_vertices)
    if len(flat) and (highest := int(flat.max())) >= message.n_vertices:
        raise InvalidMessageError(
            Reason.INDEX_RANGE,
            f"face {int(flat.argmax()) // 3} names vertex {highest}, n_vertices is {message.n_vertices}",
        )
    return Topology(message.version, message.n_vertices, flat.reshape(-1, 3))


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
        raise InvalidMessageError(Reason.MALFORMED, f"vertices has {len(flat)} coordinates, not a multiple of 3")
    _limit("vertices", len(flat) // 3, "max_vertices", max_vertices)
    return _usable(flat.reshape(-1, 3))


def vertices_from_cloud(cloud: PointCloud2, max_vertices: int) -> np.ndarray:
    """(n,3) float32 or float64 from the fields x, y, z of a PointCloud2, n = width * height.

    A view where x, y, z fill the points without a gap, else a copy. Fields may come in any order, with
    padding within points and rows; x, y, z of both types become float64 (exactly).
    Raises InvalidMessageError: big-endian, fields missing or of another type or out of bounds, too little
    data, too large, NaN, infinity or beyond 1e150.
    """
    if cloud.is_bigendian:
        raise InvalidMessageError(
            Reason.BIG_ENDIAN,
            "big-endian clouds are not supported; swap the bytes and set is_bigendian to false",
        )
    offsets, types = zip(*(_cloud_field(cloud, axis) for axis in "xyz"), strict=True)
    count = cloud.width * cloud.height
    _limit("width * height", count, "max_vertices", max_vertices)
    row_bytes = cloud.width * cloud.point_step
    # A cloud of one row may leave row_step at 0: there is no second row to step to.
    row_step = cloud.row_step if cloud.height > 1 else max(cloud.row_step, row_bytes)
    if row_step < row_bytes:
        raise InvalidMessageError(
            Reason.MALFORMED, f"row_step {row_step} is less than width * point_step = {row_bytes}"
        )
    needed = row_step * (cloud.height - 1) + row_bytes if count else 0
    if len(cloud.data) < needed:
        raise InvalidMessageError(
            Reason.MALFORMED,
            f"data has {len(cloud.data)} bytes, {cloud.height} rows of {cloud.width} points need {needed}",
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
        return _usable(data.view(types[0]).reshape(-1, 3))
    point = np.dtype({"names": list("xyz"), "formats": types, "offsets": offsets, "itemsize": cloud.point_step})
    rows = np.ndarray((cloud.height, cloud.width), point, data, strides=(row_step, cloud.point_step))
    points = np.empty((cloud.height, cloud.width, 3), np.result_type(*types))
    for axis, name in enumerate("xyz"):
        points[..., axis] = rows[name]
    return _usable(points.reshape(-1, 3))


def _cloud_field(cloud: PointCloud2, axis: str) -> tuple[int, np.dtype]:
    field = next((f for f in cloud.fields if f.name == axis), None)
    if field is None:
        raise InvalidMessageError(
            Reason.MALFORMED,
            f"no field {axis!r}; the cloud has {listed(f.name for f in cloud.fields) or 'none'}",
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


def _limit(what: str, size: int, parameter: str, limit: int) -> None:
    if size > limit:
        raise InvalidMessageError(
            Reason.TOO_LARGE, f"{what} is {size}, above the limit {limit} (parameter {parameter})"
        )


def _usable(vertices: np.ndarray) -> np.ndarray:
    if refusal := coordinates.refusal(vertices):
        raise InvalidMessageError(*refusal)
    return vertices


def topology_message(faces: np.ndarray, n_vertices: int, *, version: int = 0, stamp_ns: int = 0) -> MeshTopology:
    """faces: (F,3) integers, indices of the mesh's own vertices."""
    message = MeshTopology(version=version, n_vertices=n_vertices, check_fields=True)
    message.header.stamp = ns_to_stamp(stamp_ns)
    message.faces = to_field(np.asarray(faces).astype(np.uint32, copy=False))
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


@dataclass(frozen=True, eq=False)
class Layout:
    """Where each mesh lies in the scene-wide numbering of the core.

    ``vertex_offsets``, ``face_offsets``: (K+1,) int64, the last entry is the total. ``topology_versions``: one for each
    mesh; empty: not known.
    """

    mesh_names: tuple[str, ...]
    vertex_offsets: np.ndarray
    face_offsets: np.ndarray
    topology_versions: tuple[int, ...] = ()

    @classmethod
    def of(cls, mesh_names: tuple[str, ...], topologies: tuple[Topology, ...]) -> "Layout":
        """Meshes concatenated in the order given, as hpccd_core.Scene does."""
        return cls(
            tuple(mesh_names),
            np.cumsum([0] + [t.n_vertices for t in topologies], dtype=np.int64),
            np.cumsum([0] + [len(t.faces) for t in topologies], dtype=np.int64),
            tuple(t.version for t in topologies),
        )


def fill_contacts(
    message: ContactArray,
    contacts,
    layout: Layout,
    *,
    max_contacts: int = 0,
    outputs: tuple[str, ...] = ("points", "normals"),
) -> None:
    """Write the core's ``Contacts`` into ``message`` (all but header, start, step, accuracy, backend, drops).

    max_contacts: 0: all; else only that many of the earliest, still in canonical order (of equal times those
    first in it); ``total``, ``first_toc`` and ``hash`` are of all contacts found.
    outputs: which of points and normals to send, where the core has computed them.
    """
    n_vf, n_ee = len(contacts.vf), len(contacts.ee)
    total = n_vf + n_ee
    vf, ee, vf_toc, ee_toc = contacts.vf, contacts.ee, contacts.vf_toc, contacts.ee_toc
    points, normals = (v if v is not None and len(v) == total else None for v in (contacts.points, contacts.normals))
    truncated = 0 < max_contacts < total
    if truncated:
        keep = _earliest(np.concatenate([vf_toc, ee_toc]), max_contacts)
        of_vf, of_ee = keep[keep < n_vf], keep[keep >= n_vf] - n_vf
        vf, ee, vf_toc, ee_toc = vf[of_vf], ee[of_ee], vf_toc[of_vf], ee_toc[of_ee]
        n_vf, n_ee = len(vf), len(ee)
        points = None if points is None else points[keep]
        normals = None if normals is None else normals[keep]

    count = n_vf + n_ee
    kind, mesh_a, mesh_b = _zeros("B", count), _zeros("I", count), _zeros("I", count)
    features_a, features_b, toc = _zeros("I", 2 * count), _zeros("I", 2 * count), _zeros("d", count)
    np.frombuffer(kind, np.uint8)[n_vf:] = ContactArray.EDGE_EDGE
    in_a, in_b = (np.frombuffer(mesh, np.uint32) for mesh in (mesh_a, mesh_b))
    side_a, side_b = (np.frombuffer(side, np.uint32).reshape(-1, 2) for side in (features_a, features_b))
    side_a[:n_vf, 1] = side_b[:n_vf, 1] = ContactArray.NONE
    _localise(vf[:, 0:1], layout.vertex_offsets, in_a[:n_vf], side_a[:n_vf])
    _localise(vf[:, 1:2], layout.face_offsets, in_b[:n_vf], side_b[:n_vf])
    _localise(ee[:, 0:2], layout.vertex_offsets, in_a[n_vf:], side_a[n_vf:])
    _localise(ee[:, 2:4], layout.vertex_offsets, in_b[n_vf:], side_b[n_vf:])
    np.concatenate([vf_toc, ee_toc], out=np.frombuffer(toc))

    message.mesh_names = list(layout.mesh_names)
    message.topology_versions = array("I", layout.topology_versions)
    # Only now: the setters copy, unless the message was made with check_fields=True.
    message.kind, message.mesh_a, message.mesh_b = kind, mesh_a, mesh_b
    message.features_a, message.features_b, message.toc = features_a, features_b, toc
    if points is not None and "points" in outputs:
        message.points = to_field(points)
    if normals is not None and "normals" in outputs:
        message.normals = to_field(normals)
    message.first_toc = float(contacts.first_toc)
    message.total, message.truncated, message.hash = total, truncated, int(contacts.hash)


def _earliest(toc: np.ndarray, count: int) -> np.ndarray:
    """Indices of the ``count`` smallest values in ascending order of index; ties go to the lower index."""
    threshold = np.partition(toc, count - 1)[count - 1]
    before = np.flatnonzero(toc < threshold)
    ties = np.flatnonzero(toc == threshold)[: count - len(before)]
    return np.sort(np.concatenate([before, ties]))


def _localise(indices: np.ndarray, offsets: np.ndarray, mesh: np.ndarray, local: np.ndarray) -> None:
    """Write the mesh of each row and its indices local to that; the entries of one row belong to one mesh.

    indices: (n,k); mesh: (n,), full of zeros; local: (n, at least k).
    """
    # By columns: numpy is four times slower on many rows of one or two.
    if len(offsets) == 2:  # one mesh: nothing to look up
        for column in range(indices.shape[1]):
            local[:, column] = indices[:, column]
        return
    mesh[...] = np.searchsorted(offsets, indices[:, 0], side="right") - 1
    # In the type of the indices: numpy would widen to 64 bits, at twice the time.
    start = offsets.astype(indices.dtype)[mesh]
    for column in range(indices.shape[1]):
        np.subtract(indices[:, column], start, out=local[:, column])


@dataclass(frozen=True, eq=False)
class SceneContacts:
    """A ContactArray in the scene-wide numbering of hpccd_core.Contacts: same names, shapes and dtypes."""

    vf: np.ndarray
    vf_toc: np.ndarray
    ee: np.ndarray
    ee_toc: np.ndarray
    points: np.ndarray
    normals: np.ndarray


def other_topologies(message: ContactArray, layout: Layout) -> str | None:
    """In words, where both tell the versions of their topologies and these differ; else None."""
    of_message, of_layout = tuple(message.topology_versions), layout.topology_versions
    if not of_message or not of_layout or of_message == of_layout:
        return None
    return f"the contacts are of topology versions {list(of_message)}, the layout is of {list(of_layout)}"


def read_contacts(message: ContactArray, layout: Layout) -> SceneContacts:
    """The inverse of fill_contacts (what was cut off stays cut off). points, normals: (N,3) or (0,3).

    Raises ValueError where the message belongs to other versions of the topologies than the layout.
    """
    if why := other_topologies(message, layout):
        raise ValueError(f"layout: {why}; make it of the topologies of these versions")
    kind = np.frombuffer(message.kind, np.uint8)
    n_vf = int(np.count_nonzero(kind == ContactArray.VERTEX_FACE))
    mesh_a = np.frombuffer(message.mesh_a, np.uint32)
    mesh_b = np.frombuffer(message.mesh_b, np.uint32)
    side_a = np.frombuffer(message.features_a, np.uint32).reshape(-1, 2)
    side_b = np.frombuffer(message.features_b, np.uint32).reshape(-1, 2)
    toc = np.frombuffer(message.toc, np.float64)
    vertices, faces = layout.vertex_offsets, layout.face_offsets
    vf = np.stack([side_a[:n_vf, 0] + vertices[mesh_a[:n_vf]], side_b[:n_vf, 0] + faces[mesh_b[:n_vf]]], axis=1)
    ee = np.concatenate(
        [side_a[n_vf:] + vertices[mesh_a[n_vf:], None], side_b[n_vf:] + vertices[mesh_b[n_vf:], None]], axis=1
    )
    return SceneContacts(
        vf.astype(np.uint32),
        toc[:n_vf],
        ee.astype(np.uint32),
        toc[n_vf:],
        np.frombuffer(message.points, np.float64).reshape(-1, 3),
        np.frombuffer(message.normals, np.float64).reshape(-1, 3),
    )
