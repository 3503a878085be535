# SPDX-License-Identifier: Apache-2.0
"""shape_msgs/Mesh and markers of triangles -> vertices and topology, and what is rejected of them."""

import math
import struct

import numpy as np
import pytest
from geometry_msgs.msg import Point
from rclpy.serialization import serialize_message
from shape_msgs.msg import Mesh, MeshTriangle
from visualization_msgs.msg import Marker
from whole_meshes import marker_of, shape_of

from hpccd_core.rigid.transform import Rigid
from hpccd_ros.frames.drops import Reason
from hpccd_ros.frames.welding import Welding
from hpccd_ros.middleware import mesh_inputs
from hpccd_ros.middleware.fields import InvalidMessageError

VERTICES = np.array([[0.1, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.5]])
FACES = np.array([[0, 1, 2], [3, 2, 1]], np.uint32)
LIMITS = {"max_vertices": 100, "max_faces": 100}


def read(kind, message, sent=7, limits=LIMITS, welding=None):
    data = message if isinstance(message, bytes) else serialize_message(message)
    return mesh_inputs.read(kind, data, limits, sent=sent, welding=welding or Welding())


def test_a_shape():
    frame = read("shape", shape_of(VERTICES, FACES))
    assert np.array_equal(frame.vertices, VERTICES) and np.array_equal(frame.topology.faces, FACES)
    assert (frame.stamp, frame.step, frame.frame_id) == (7, None, "")
    assert (frame.topology.n_vertices, frame.version) == (4, frame.topology.version)


def test_a_marker():
    frame = read("marker", marker_of(VERTICES, FACES, stamp=5, frame_id="world"))
    assert np.array_equal(frame.vertices, VERTICES) and np.array_equal(frame.topology.faces, FACES)
    assert (frame.stamp, frame.frame_id) == (5, "world")
    assert frame.version == read("shape", shape_of(VERTICES, FACES)).version, "of the topology alone"
    other = read("marker", marker_of(VERTICES, FACES[:, [1, 0, 2]]))
    assert other.version != frame.version


def test_scale_and_pose_of_a_marker():
    message = marker_of(VERTICES, FACES)
    message.scale.x, message.scale.y, message.scale.z = 2.0, -1.0, 0.5
    shift, turn = (1.0, 2.0, 3.0), (0.0, 0.0, math.sin(0.3), math.cos(0.3))
    pose = message.pose
    pose.position.x, pose.position.y, pose.position.z = shift
    pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w = turn
    frame = read("marker", message)
    assert np.array_equal(frame.vertices, Rigid.of(shift, turn).apply(VERTICES * [2.0, -1.0, 0.5]))
    assert np.array_equal(frame.topology.faces, FACES), "welded as it came"


def test_numbers_that_differ_by_the_pose_only_keep_the_topology():
    welding = Welding()
    first = read("marker", marker_of(VERTICES, FACES), welding=welding)
    second = read("marker", marker_of(VERTICES * 1.25, FACES), welding=welding)
    assert second.topology.faces is first.topology.faces and second.version == first.version


def marker(**changes):
    message = marker_of(VERTICES, FACES)
    for name, value in changes.items():
        setattr(message, name, value)
    return message


def shape(triangles=FACES, vertices=VERTICES):
    return shape_of(np.asarray(vertices, np.float64), np.asarray(triangles))


def scaled(x, y, z):
    message = marker_of(VERTICES, FACES)
    message.scale.x, message.scale.y, message.scale.z = x, y, z
    return message


def turned(w):
    message = marker_of(VERTICES, FACES)
    message.pose.orientation.w = w
    return message


def stamped(sec, nanosec):
    message = marker_of(VERTICES, FACES)
    message.header.stamp.sec, message.header.stamp.nanosec = sec, nanosec
    return message


BEYOND = VERTICES + [[0, 0, 0], [0, 0, 0], [0, 0, 0], [math.nan, 0, 0]]


@pytest.mark.parametrize(
    "kind, message, reason, text",
    [
        ("marker", marker(action=Marker.DELETE), Reason.UNSUPPORTED_TYPE, "marker with action DELETE: a mesh"),
        ("marker", marker(action=Marker.DELETEALL), Reason.UNSUPPORTED_TYPE, "marker with action DELETEALL"),
        ("marker", marker(action=9), Reason.UNSUPPORTED_TYPE, "marker with action 9"),
        ("marker", marker(type=Marker.CUBE), Reason.UNSUPPORTED_TYPE, "marker of type 1; only TRIANGLE_LIST (11) is"),
        ("marker", stamped(-1, 0), Reason.MALFORMED, "stamp has sec -1 and nanosec 0"),
        ("marker", b"", Reason.MALFORMED, "its bytes begin with nothing, which is not plain CDR"),
        ("shape", b"\0\7\0\0" + bytes(64), Reason.MALFORMED, "its bytes begin with 00070000"),
        ("marker", marker(points=[]), Reason.MALFORMED, "points is empty"),
        ("marker", marker(points=[Point()] * 4), Reason.MALFORMED, "points has 4 points, not a multiple of 3"),
        ("marker", scaled(1.0, 0.0, 1.0), Reason.MALFORMED, "scale is [1.0, 0.0, 1.0]; it multiplies the points"),
        ("marker", scaled(1.0, math.inf, 1.0), Reason.MALFORMED, "scale is [1.0, inf, 1.0]"),
        ("marker", scaled(1e300, 1.0, 1.0), Reason.OUT_OF_RANGE, "coordinates must lie in"),
        ("marker", turned(0.0), Reason.MALFORMED, "pose: the quaternion [0.0, 0.0, 0.0, 0.0] has length 0"),
        ("marker", marker_of(BEYOND, FACES), Reason.NOT_FINITE, "coordinates must be finite"),
        ("marker", marker_of(VERTICES, np.repeat(FACES, 51, axis=0)), Reason.TOO_LARGE, "(parameter max_faces)"),
        (
            "shape",
            shape(triangles=[[0, 1, 4]]),
            Reason.INDEX_RANGE,
            "triangle 0 names vertex 4, the mesh has 4 vertices",
        ),
        ("shape", Mesh(), Reason.MALFORMED, "triangles is empty"),
        ("shape", Mesh(vertices=[Point()] * 3), Reason.MALFORMED, "triangles is empty"),
        ("shape", Mesh(triangles=[MeshTriangle()]), Reason.MALFORMED, "vertices is empty"),
        ("shape", shape(vertices=BEYOND), Reason.NOT_FINITE, "vertex 3 is [nan, 1.0, 0.5]"),
        ("shape", shape(vertices=np.zeros((101, 3))), Reason.TOO_LARGE, "vertices is 101, above the limit 100"),
        ("shape", shape(triangles=np.repeat(FACES, 51, axis=0)), Reason.TOO_LARGE, "triangles is 102, above"),
    ],
)
def test_what_is_rejected(kind, message, reason, text):
    with pytest.raises(InvalidMessageError) as caught:
        read(kind, message)
    assert caught.value.reason == reason and text in str(caught.value)


def test_too_many_vertices_of_a_marker():
    with pytest.raises(InvalidMessageError, match="vertices is 4, above the limit 3 .parameter max_vertices"):
        read("marker", marker_of(VERTICES, FACES), limits={"max_vertices": 3, "max_faces": 100})


def test_a_shape_without_a_time_of_sending():
    with pytest.raises(InvalidMessageError, match="its publisher sends no source timestamp"):
        read("shape", shape_of(VERTICES, FACES), sent=0)


TEXTS = marker_of(VERTICES, FACES, stamp=3 * 10**9 + 5, frame_id="a frame")
TEXTS.ns, TEXTS.text, TEXTS.id = "some", "behind the points", 5


@pytest.mark.parametrize("length", range(8))
def test_texts_of_any_length_before_the_numbers(length):
    message = marker_of(VERTICES, FACES, stamp=3 * 10**9 + 5, frame_id="f" * length)
    message.ns, message.text, message.frame_locked = "n" * (length // 2), "behind the points", True
    frame = read("marker", message)
    assert (frame.stamp, frame.frame_id) == (3 * 10**9 + 5, "f" * length)
    assert np.array_equal(frame.vertices, VERTICES)


def big_endian_shape():
    body = struct.pack(">I", len(FACES)) + FACES.astype(">u4").tobytes() + struct.pack(">I", len(VERTICES))
    return b"\0\0\0\0" + body + bytes(-len(body) % 8) + VERTICES.astype(">f8").tobytes()


def test_the_other_order_of_bytes():
    frame = read("shape", big_endian_shape())
    assert np.array_equal(frame.vertices, VERTICES) and np.array_equal(frame.topology.faces, FACES)
    assert frame.version == read("shape", shape_of(VERTICES, FACES)).version


@pytest.mark.parametrize("kind, message", [("marker", TEXTS), ("shape", shape_of(VERTICES, FACES))])
def test_bytes_that_are_cut_off_or_changed(kind, message):
    """Each is read as some mesh or rejected, and none that ends before the vertices do is read."""
    data = serialize_message(message)
    whole = read(kind, data)
    needed = data.index(VERTICES[3].tobytes()) + 24 if kind == "shape" else data.index(b"behind") - 60
    for length in range(needed):
        with pytest.raises(InvalidMessageError):
            read(kind, data[:length])
    rng = np.random.default_rng(7)
    rejected = 0
    for _ in range(3000):
        changed = bytearray(data)
        for place in rng.integers(0, len(data), rng.integers(1, 4)):
            changed[place] = rng.integers(0, 256)
        try:
            frame = read(kind, bytes(changed))
        except InvalidMessageError:
            rejected += 1
        else:
            assert len(frame.vertices) == frame.topology.n_vertices > int(frame.topology.faces.max())
    assert rejected > 100 and np.array_equal(whole.vertices, VERTICES)
