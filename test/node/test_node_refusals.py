# SPDX-License-Identifier: Apache-2.0
"""Bad input is counted, diagnosed, and the node goes on: one test for each kind."""

import math

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from hpccd.msg import MeshTopology, MeshVertices
from node_process import assert_same_contacts
from waving_sheet import scene_of, sheet_faces, sheet_positions

from hpccd_ros.middleware import fields, mesh_messages, qos

N = 8
FACES = sheet_faces(N)
GOOD = sheet_positions(N, 0)


def vertices(**fields):
    message = mesh_messages.vertices_message(GOOD, 50)
    for name, value in fields.items():
        setattr(message, name, value)
    return message


def with_coordinate(value, dtype):
    points = GOOD.astype(dtype)
    points[7, 2] = value
    return mesh_messages.vertices_message(points, 50)


def stamped(sec, nanosec):
    message = vertices()
    message.header.stamp = Time(sec=sec, nanosec=nanosec)
    return message


BAD_VERTICES = {
    "shape": (vertices(vertices_f32=fields.to_field(GOOD.ravel()[:-1])), "malformed", "not a multiple of 3"),
    "no dtype": (vertices(vertices_f32=fields.to_field(GOOD[:0])), "malformed", "both are empty"),
    "two dtypes": (
        vertices(vertices_f64=fields.to_field(GOOD.astype(float))),
        "malformed",
        "both are filled",
    ),
    "count": (mesh_messages.vertices_message(GOOD[:-1], 50), "wrong_vertex_count", "63 vertices"),
    "nan": (with_coordinate(math.nan, np.float32), "not_finite", "vertex 7"),
    "inf": (with_coordinate(-math.inf, np.float64), "not_finite", "vertex 7"),
    "far": (with_coordinate(1e151, np.float64), "out_of_range", "vertex 7"),
    "nanosec": (stamped(0, 1_000_000_050), "malformed", "nanosec 1000000050"),
    "last second": (stamped(2**31 - 1, 2**32 - 1), "malformed", "nanosec below"),
    "negative": (stamped(-1, 0), "malformed", "sec -1"),
    "old version": (vertices(topology_version=2), "old_topology", "version 2"),
    "backward": (mesh_messages.vertices_message(GOOD, 9), "stamp_backward", "before the last one"),
    "repeated": (mesh_messages.vertices_message(GOOD, 11), "stamp_repeated", "came before"),
    "frame": (mesh_messages.vertices_message(GOOD, 50, frame_id="elsewhere"), "frame_id", "'elsewhere'"),
    "size": (mesh_messages.vertices_message(np.zeros((101, 3), np.float32), 50), "too_large", "max_vertices"),
}


@pytest.fixture
def streaming(start_node):
    """A node that has processed one step, and a check that it goes on as if nothing had been."""
    node = start_node({"meshes": ["cloth"], "max_vertices": 100, "restart_after": 0})
    node.peer.topology("cloth", FACES, N * N, version=3)

    def send(step):
        node.peer.vertices("cloth", sheet_positions(N, step), 10 + step, topology_version=3, frame_id="world")

    def goes_on():
        before = len(node.peer.received)
        send(2)
        message = node.contacts(before + 1)[before]
        assert fields.stamp_to_ns(message.start) == 11, "the rejected frame is not a start either"
        expected = sheet_positions(N, 1), sheet_positions(N, 2)
        assert_same_contacts(message, *expected, scene_of(cloth=FACES))
        return message

    send(0)
    send(1)
    node.contacts(1)
    return node, goes_on


@pytest.mark.parametrize("kind", BAD_VERTICES)
def test_bad_vertices(streaming, kind):
    node, goes_on = streaming
    message, reason, text = BAD_VERTICES[kind]
    if kind != "old version":
        message.topology_version = 3
    node.peer.publisher(MeshVertices, "meshes/cloth/vertices").publish(message)
    values = node.frames_status(dropped=1, **{f"dropped__cloth__{reason}": 1})
    assert text in values["last_rejection"]
    result = goes_on()
    assert result.dropped_frames == 1
    node.frames_status(received=4, processed=3, dropped=1, waiting=0)
    node.wait_until(lambda: text in node.output(), "line in the log")


# A sequence of four thousand million floats in a message of 54 bytes.
UNREADABLE = b"\0\1\0\0" + b"\xff" * 50


def test_what_cannot_be_deserialised_is_told_as_such(streaming):
    node, goes_on = streaming
    publisher = node.peer.publisher(MeshVertices, "meshes/cloth/vertices")
    for count in (1, 2):
        publisher.publish(UNREADABLE)
        values = node.frames_status(dropped=count, dropped__cloth__malformed=count)
    assert "cannot be deserialised" in values["last_rejection"] and "input_depth" not in node.output()
    for _ in range(5):  # how many these are is known at the next that is read
        publisher.publish(UNREADABLE)
    node.wait_until(lambda: int(node.peer.statuses["frames"][2]["dropped"]) >= 3, "count of the unreadable ones")
    result = goes_on()
    assert result.dropped_frames == 7
    values = node.frames_status(received=10, processed=3, dropped=7, dropped__cloth__malformed=7, waiting=0)
    assert "dropped.middleware" not in values


def test_a_topology_that_cannot_be_deserialised_is_told(streaming):
    node, goes_on = streaming
    node.peer.publisher(MeshTopology, "meshes/cloth/topology").publish(UNREADABLE)
    values = node.frames_status(topologies_rejected=1, topologies_rejected__cloth__malformed=1)
    assert "cannot be deserialised" in values["last_rejection"]
    goes_on()


def bad_topology(faces, n_vertices=N * N, version=4):
    message = MeshTopology(version=version, n_vertices=n_vertices)
    message.faces = fields.to_field(np.array(faces, np.uint32))
    return message


@pytest.mark.parametrize(
    "message, reason, text",
    [
        (bad_topology([0, 1, 64]), "index_range", "face 0 names vertex 64"),
        (bad_topology([0, 1, 2, 3]), "malformed", "not a multiple of 3"),
        (bad_topology([0, 1, 2], version=2), "old_topology", "version 2 is older than 3"),
        (bad_topology([0, 1, 2], version=3), "topology_conflict", "count the version up"),
        (bad_topology([0, 1, 2], n_vertices=101), "too_large", "max_vertices"),
    ],
    ids=["index", "shape", "old", "conflict", "size"],
)
def test_bad_topology(streaming, message, reason, text):
    node, goes_on = streaming
    node.peer.publisher(MeshTopology, "meshes/cloth/topology").publish(message)
    values = node.frames_status(topologies_rejected=1, **{f"topologies_rejected__cloth__{reason}": 1})
    assert text in values["last_rejection"]
    goes_on()


def test_a_triangle_that_names_a_vertex_twice_is_a_segment(start_node):
    node = start_node({"meshes": ["cloth"]})
    faces = np.array([[0, 0, 1], [2, 3, 4]])
    node.peer.topology("cloth", faces, 5)
    start = np.array([[0, 0, 0], [2, 0, 0], [1, 0, 1], [0, 5, 5], [2, 5, 5]], np.float32)
    end = start - np.array([[0, 0, 0], [0, 0, 0], [0, 0, 2], [0, 0, 0], [0, 0, 0]], np.float32)
    for k, positions in enumerate((start, end)):
        node.peer.vertices("cloth", positions, k)
        node.frames_status(processed=k + 1)
    message = node.contacts(1)[0]
    assert assert_same_contacts(message, start, end, scene_of(cloth=faces)) > 0, "vertex 2 goes through it"
    assert node.peer.statuses["frames"][2].get("topologies_rejected", "0") == "0"


def test_a_conflict_right_behind_the_topology_does_not_replace_it(start_node):
    """Both wait for the node: it takes them one after the other, however late."""
    node = start_node({"meshes": ["cloth"]})
    publisher = node.peer.publisher(MeshTopology, "meshes/cloth/topology", qos.TOPOLOGY_INPUT)
    for faces in (FACES, FACES[1:]):
        publisher.publish(mesh_messages.topology_message(faces, N * N, version=3))
    node.frames_status(topologies_rejected=1, topologies_rejected__cloth__topology_conflict=1)
    for k in range(2):
        node.peer.vertices("cloth", sheet_positions(N, k), k, topology_version=3)
        node.frames_status(processed=k + 1)
    expected = sheet_positions(N, 0), sheet_positions(N, 1)
    assert assert_same_contacts(node.contacts(1)[0], *expected, scene_of(cloth=FACES)) > 0


def test_frames_of_an_unknown_mesh(streaming):
    node, goes_on = streaming
    publisher = node.peer.publisher(MeshVertices, "meshes/clot/vertices")  # waits until the node listens
    for k in range(3):
        publisher.publish(mesh_messages.vertices_message(GOOD, k))
    node.frames_status(dropped__clot__unknown_mesh=3, received__clot=3)
    warning = node.wait_until(lambda: "clot/vertices" in node.peer.statuses["frames"][1], "warning")
    assert warning
    goes_on()


def unknown_topics(node):
    """How the diagnostics name topics of unknown meshes."""
    return [
        line for line in node.peer.statuses["frames"][1].split("; ") if " to no mesh " in line or "more topic" in line
    ]


def test_unknown_meshes_that_are_gone_make_room_for_others(streaming):
    node, goes_on = streaming
    create = node.peer.node.create_publisher
    strays = [create(MeshVertices, f"meshes/stray{k}/vertices", 10) for k in range(19)]
    node.wait_until(
        lambda: "3 more topics without a mesh" in node.peer.statuses["frames"][1], "topics beyond the bound"
    )
    lines = unknown_topics(node)
    assert len(lines) == 17 and "not counted (16 are)" in lines[-1]
    for stray in strays:
        node.peer.node.destroy_publisher(stray)
    node.wait_until(lambda: not unknown_topics(node), "topics without publishers to be let go")
    node.peer.publisher(MeshVertices, "meshes/clot/vertices").publish(mesh_messages.vertices_message(GOOD, 1))
    node.frames_status(dropped__clot__unknown_mesh=1, received__clot=1)
    assert node.peer.node.count_subscribers(f"{node.namespace}/meshes/stray0/vertices") == 0
    goes_on()


def test_meshes_of_another_node_are_not_counted(streaming, start_node):
    """Two nodes share the names; one who merely listens to everything, as recorders do, is no owner of a mesh."""
    node, goes_on = streaming
    rules = (f"meshes/ball/{kind}:={node.namespace}/meshes/ball/{kind}" for kind in ("topology", "vertices"))
    other = start_node({"meshes": ["ball"]}, remaps=tuple(rules))
    for name in ("ball", "clot"):
        node.peer.node.create_subscription(MeshTopology, f"meshes/{name}/topology", lambda message: None, 10)
    node.peer.topology("ball", FACES, N * N)
    publisher = node.peer.publisher(MeshVertices, "meshes/ball/vertices")  # the first node may be its first reader

    def other_listens():
        found = node.peer.node.get_subscriptions_info_by_topic(publisher.topic_name)
        named = other.namespace in {subscription.node_namespace for subscription in found}
        return named and publisher.get_subscription_count() >= len(found)

    node.wait_until(other_listens, "the subscription of the other node")
    for k in range(3):
        node.peer.vertices("ball", sheet_positions(N, k), k)
        other.frames_status(received=k + 1, processed=k + 1)
    node.peer.publisher(MeshVertices, "meshes/clot/vertices").publish(mesh_messages.vertices_message(GOOD, 1))
    values = node.frames_status(dropped=1, dropped__clot__unknown_mesh=1)
    assert "received.ball" not in values
    assert not [line for line in unknown_topics(node) if "ball" in line]
    goes_on()


def test_vertices_without_a_topology(start_node):
    node = start_node({"meshes": ["cloth"], "pending_frames": 2})
    for k in range(5):
        node.peer.vertices("cloth", GOOD, k)
    values = node.frames_status(received=5, waiting=2, dropped__cloth__no_topology=3)
    assert "meshes/cloth/topology" in values["last_rejection"]


def test_incompatible_qos_is_told(start_node):
    node = start_node({"meshes": ["cloth"]})
    node.peer.node.create_publisher(MeshVertices, "meshes/cloth/vertices", qos.vertices("best_effort", 1))
    node.wait_until(
        lambda: node.peer.statuses["frames"][2].get("qos_incompatible.meshes/cloth/vertices") == "1",
        "QoS incompatibility in the diagnostics",
    )
    node.wait_until(lambda: "input_reliability" in node.output(), "the remedy in the log")


def test_restarted_publisher_is_heard_at_once(start_node):
    node = start_node({"meshes": ["cloth"]})
    node.peer.topology("cloth", FACES, N * N, version=7)
    for k in range(3):
        node.peer.vertices("cloth", sheet_positions(N, k), 1000 + k, topology_version=7)
        node.contacts(k)
    node.peer.forget_publisher("meshes/cloth/vertices")
    node.peer.forget_publisher("meshes/cloth/topology")
    node.peer.topology("cloth", FACES, N * N, version=1)
    for k in range(3):
        node.peer.vertices("cloth", sheet_positions(N, k), 10 + k, topology_version=1)
        node.contacts(2 + k)
    message = node.contacts(4)[2]
    assert fields.stamp_to_ns(message.start) == 10
    node.frames_status(restarts=1, received=6, processed=6, dropped=0)


def test_restarted_simulation_brings_its_own_frame(start_node):
    node = start_node({"meshes": ["cloth"]})
    node.peer.topology("cloth", FACES, N * N)
    node.peer.vertices("cloth", GOOD, 1, frame_id="stray")
    node.frames_status(processed=1, frame_id="stray", frame_id_by="a message of mesh cloth")
    node.peer.forget_publisher("meshes/cloth/vertices")
    for k in range(3):
        node.peer.vertices("cloth", sheet_positions(N, k), 10 + k, frame_id="world")
        node.contacts(k)
    for message, k in zip(node.contacts(2), (1, 2), strict=True):
        assert (message.header.frame_id, fields.stamp_to_ns(message.start)) == ("world", 9 + k)
        assert_same_contacts(message, sheet_positions(N, k - 1), sheet_positions(N, k), scene_of(cloth=FACES))
    node.frames_status(processed=4, dropped=0, restarts=1, frame_id="world")


def test_no_time_is_hidden_by_a_frame_that_cannot_be_tested(start_node):
    """Finite, but beyond what the core computes with."""
    node = start_node({"meshes": ["cloth"]})
    node.peer.topology("cloth", FACES, N * N)
    for k in range(4):
        scale = 1e200 if k in (0, 2) else 1.0
        node.peer.vertices("cloth", scale * sheet_positions(N, k, dtype=np.float64), k)
        node.frames_status(received=k + 1, waiting=0)
    values = node.frames_status(processed=2, dropped=2, dropped__cloth__out_of_range=2)
    assert "1e+150" in values["last_rejection"]
    (message,) = node.contacts(1)
    assert (fields.stamp_to_ns(message.start), fields.stamp_to_ns(message.header.stamp)) == (1, 3)
    assert_same_contacts(message, *(sheet_positions(N, k, dtype=np.float64) for k in (1, 3)), scene_of(cloth=FACES))
