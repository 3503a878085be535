# SPDX-License-Identifier: Apache-2.0
"""Frames sent over DDS to the node's process give the contacts that the core gives for the same frames."""

import os
from pathlib import Path

import numpy as np
import pytest
from clouds import F32, F64, cloud
from hpccd.msg import ContactArray, MeshVertices
from node_process import assert_same_contacts
from rclpy.qos import ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray
from waving_sheet import scene_of, sheet_faces, sheet_positions

import hpccd_core as hc
from hpccd_core.options import OUTPUTS
from hpccd_core.results import OUTPUT_ARRAYS
from hpccd_ros import client
from hpccd_ros.detect.layout import Layout
from hpccd_ros.middleware import contact_messages, fields, mesh_messages, qos

N = 16
FACES = sheet_faces(N)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_every_step_of_one_mesh(start_node, dtype):
    node = start_node({"meshes": ["cloth"]})
    node.peer.topology("cloth", FACES, N * N)
    positions = [sheet_positions(N, k, dtype=dtype) for k in range(6)]
    for k, vertices in enumerate(positions):
        node.peer.vertices("cloth", vertices, stamp=10**9 + k, step=100 + k, frame_id="world")
        node.contacts(k)  # the first frame has no start: it gives none
    found = 0
    for k, message in enumerate(node.contacts(5), start=1):
        assert (fields.stamp_to_ns(message.start), fields.stamp_to_ns(message.header.stamp)) == (
            10**9 + k - 1,
            10**9 + k,
        )
        assert (message.step, message.header.frame_id) == (100 + k, "world")
        assert (message.accuracy, message.backend, message.dropped_frames) == ("exact", "cpu", 0)
        assert not any(len(getattr(message, name)) for name in OUTPUT_ARRAYS)
        found += assert_same_contacts(message, positions[k - 1], positions[k], scene_of(cloth=FACES))
    assert found > 100, "the scene is made to touch"
    node.frames_status(received=6, processed=6, dropped=0, waiting=0)


def test_two_meshes_are_assembled_by_stamp(start_node):
    """The second mesh comes late and in another precision; each result joins equal stamps."""
    node = start_node({"meshes": ["cloth", "net"], "frame_queue": 100, "outputs": list(OUTPUTS)})
    scene = scene_of(cloth=FACES, net=FACES)
    node.peer.topology("net", FACES, N * N)
    node.peer.topology("cloth", FACES, N * N)
    cloth = [sheet_positions(N, k) for k in range(5)]
    net = [sheet_positions(N, k + 2, offset=0.01, dtype=np.float64) for k in range(5)]
    for k in (0, 1, 2):
        node.peer.vertices("cloth", cloth[k], stamp=k)
    for k in (0, 1, 2, 3, 4):
        node.peer.vertices("net", net[k], stamp=k)
    for k in (3, 4):
        node.peer.vertices("cloth", cloth[k], stamp=k)
    both = [np.concatenate([a, b]) for a, b in zip(cloth, net, strict=True)]
    between = 0
    for k, message in enumerate(node.contacts(4), start=1):
        assert list(message.mesh_names) == ["cloth", "net"]
        assert_same_contacts(message, both[k - 1], both[k], scene, outputs=OUTPUTS)
        between += np.count_nonzero(
            np.frombuffer(message.mesh_a, np.uint32) != np.frombuffer(message.mesh_b, np.uint32)
        )
        found = client.contacts_from_message(message)
        expected = hc.Detector(scene, outputs=OUTPUTS).detect(both[k - 1], both[k])
        assert_vertices_within_meshes(found)
        for told, computed in zip(found.toc_gradients(), expected.toc_gradients(), strict=True):
            assert np.array_equal(told, computed, equal_nan=True) and np.isfinite(told).any()
    assert between > 10, "the meshes are made to touch each other"
    node.frames_status(received=10, processed=10, dropped=0)


def assert_vertices_within_meshes(found):
    """Of faces their corners, of edges their ends; both meshes have the same faces."""
    vertex_face = np.arange(len(found)) < found.n_vertex_face
    v, corners = found.vertices[vertex_face, 0], found.vertices[vertex_face, 1:]
    assert np.array_equal(v, found.features_a[vertex_face, 0])
    assert np.array_equal(corners, FACES[found.features_b[vertex_face, 0]])
    edges = np.concatenate([found.features_a, found.features_b], axis=1)
    assert np.array_equal(found.vertices[~vertex_face], edges[~vertex_face])


def test_scene_options_reach_the_core(start_node):
    node = start_node(
        {
            "meshes": ["cloth", "net", "floor"],
            "mesh": {"net": {"self_collision": False}, "floor": {"static": True}},
            "ignored_pairs": ["cloth:floor"],
        }
    )
    scene = hc.Scene()
    scene.add_mesh("cloth", FACES)
    scene.add_mesh("net", FACES, self_collision=False)
    scene.add_mesh("floor", FACES, static=True)
    scene.ignore_pair("cloth", "floor")
    floor = sheet_positions(N, 9, offset=-0.005)
    for name in ("cloth", "net", "floor"):
        node.peer.topology(name, FACES, N * N)
    node.peer.vertices("floor", floor, stamp=0)
    node.frames_status(processed=1)
    frames = []
    for k in range(3):
        parts = [sheet_positions(N, k), sheet_positions(N, k + 3, offset=0.004), floor]
        node.peer.vertices("cloth", parts[0], stamp=k + 1)
        node.peer.vertices("net", parts[1], stamp=k + 1)
        frames.append(np.concatenate(parts))
        node.contacts(k)
    for k, message in enumerate(node.contacts(2), start=1):
        assert assert_same_contacts(message, frames[k - 1], frames[k], scene) > 0
    node.frames_status(received=7, processed=7, dropped=0)


def test_topology_change_in_mid_stream(start_node):
    node = start_node({"meshes": ["cloth"]})
    small, large = sheet_faces(8), FACES
    node.peer.topology("cloth", small, 64, version=1)
    a = [sheet_positions(8, k) for k in range(2)]
    for k in range(2):
        node.peer.vertices("cloth", a[k], stamp=k, topology_version=1)
        node.contacts(k)
    assert_same_contacts(node.contacts(1)[0], a[0], a[1], scene_of(cloth=small))
    # Vertices of the new version may overtake their topology: they wait for it.
    b = [sheet_positions(N, k) for k in range(3)]
    node.peer.vertices("cloth", b[0], stamp=10, topology_version=2)
    node.frames_status(received=3, waiting=1)
    node.peer.topology("cloth", large, N * N, version=2)
    node.frames_status(processed=3, waiting=0)
    node.peer.vertices("cloth", b[1], stamp=11, topology_version=2)
    message = node.contacts(2)[1]
    assert fields.stamp_to_ns(message.start) == 10, "no motion from the old topology to the new one"
    assert [list(m.topology_versions) for m in node.contacts(2)] == [[1], [2]]
    assert_same_contacts(message, b[0], b[1], scene_of(cloth=large))
    node.peer.vertices("cloth", a[0], stamp=12, topology_version=1)
    node.frames_status(dropped=1, dropped__cloth__old_topology=1)
    node.peer.vertices("cloth", b[2], stamp=13, topology_version=2)
    assert_same_contacts(node.contacts(3)[2], b[1], b[2], scene_of(cloth=large))


@pytest.mark.parametrize(
    "layout",
    [
        {},
        {"kinds": [F64] * 3, "offsets": [0, 8, 16], "step": 32},
        {"kinds": [F32] * 3, "offsets": [8, 0, 4], "step": 16, "height": 2, "row_pad": 8},
    ],
    ids=["dense", "float64-padded", "reordered-rows"],
)
def test_point_clouds(start_node, layout):
    node = start_node({"meshes": ["cloth"], "mesh": {"cloth": {"input": "points"}}})
    n = 8
    node.peer.topology("cloth", sheet_faces(n), n * n)
    publisher = node.peer.publisher(PointCloud2, "meshes/cloth/points")
    dtype = np.float64 if F64 in layout.get("kinds", []) else np.float32
    frames = [sheet_positions(n, k, dtype=dtype) for k in range(3)]
    for k, vertices in enumerate(frames):
        message = cloud(vertices, **layout)
        message.header.stamp = fields.ns_to_stamp(k)
        publisher.publish(message)
        node.contacts(k)
    for k, message in enumerate(node.contacts(2), start=1):
        assert assert_same_contacts(message, frames[k - 1], frames[k], scene_of(cloth=sheet_faces(n))) > 0
        assert message.step == k
    rejected = cloud(frames[0], **layout)
    rejected.header.stamp = fields.ns_to_stamp(100)
    rejected.is_bigendian = True
    publisher.publish(rejected)
    values = node.frames_status(dropped=1, dropped__cloth__big_endian=1)
    assert "swap the bytes" in values["last_rejection"]


def test_topology_and_static_mesh_from_files(start_node, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    floor = sheet_positions(N, 9, dtype=np.float64)
    floor_file, cloth_file = tmp_path / "floor.ply", tmp_path / "cloth.obj"
    floor_file.write_bytes(trimesh.Trimesh(floor, FACES, process=False).export(file_type="ply"))
    cloth_file.write_text(trimesh.Trimesh(floor, FACES, process=False).export(file_type="obj"))
    lift = 0.004
    node = start_node(
        {
            "meshes": ["cloth", "floor"],
            "mesh": {
                "cloth": {"file": str(cloth_file)},
                "floor": {
                    "file": str(floor_file),
                    "static": True,
                    "pose": [0.0, 0.0, lift, 0.0, 0.0, 0.0, 1.0],
                },
            },
        }
    )
    placed = trimesh.load(floor_file, process=False).vertices + [0, 0, lift]
    scene = hc.Scene()
    scene.add_mesh("cloth", FACES)
    scene.add_mesh("floor", FACES, static=True)
    frames = [np.concatenate([sheet_positions(N, k), placed]) for k in range(2)]
    for k in range(2):
        node.peer.vertices("cloth", sheet_positions(N, k), stamp=k)
    assert assert_same_contacts(node.contacts(1)[0], *frames, scene) > 0


def test_truncated_contacts_are_the_earliest(start_node):
    node = start_node({"meshes": ["cloth"], "max_contacts": 10, "outputs": ["normals", "weights"]})
    node.peer.topology("cloth", FACES, N * N)
    frames = [sheet_positions(N, k) for k in range(2)]
    for k in range(2):
        node.peer.vertices("cloth", frames[k], stamp=k)
    message = node.contacts(1)[0]
    full = hc.Detector(scene_of(cloth=FACES), outputs=("normals", "weights")).detect(*frames)
    assert message.truncated and message.total == len(full) and len(message.toc) == 10
    earliest = np.sort(np.concatenate([full.vf_toc, full.ee_toc]))[:10]
    assert np.array_equal(np.sort(message.toc), earliest)
    assert message.hash == full.hash and message.first_toc == full.first_toc
    kept = np.sort(np.argsort(np.concatenate([full.vf_toc, full.ee_toc]), kind="stable")[:10])
    found = client.contacts_from_message(message)
    for name in ("normals", "vertices", "weights", "approach"):
        assert np.array_equal(getattr(found, name), getattr(full, name)[kept]), name


def test_names_are_relative_and_remappable(start_node):
    node = start_node({"meshes": ["cloth"]}, remaps=("contacts:=hits", "meshes/cloth/vertices:=simulation/points"))
    hits = []
    node.peer.node.create_subscription(ContactArray, "hits", hits.append, qos.CONTACTS)
    node.peer.topology("cloth", FACES, N * N)
    publisher = node.peer.publisher(MeshVertices, "simulation/points")
    for k in range(2):
        publisher.publish(mesh_messages.vertices_message(sheet_positions(N, k), k))
    node.wait_until(lambda: hits, "contacts on the remapped topic")
    assert not node.peer.received


def test_markers_on_request(start_node):
    node = start_node({"meshes": ["cloth"], "markers": True, "markers_max": 20, "markers_size": 0.5})
    markers, surfaces = [], []
    node.peer.node.create_subscription(MarkerArray, "markers", markers.append, qos.MARKERS)
    node.peer.node.create_subscription(PointCloud2, "surface", surfaces.append, qos.MARKERS)
    node.peer.topology("cloth", FACES, N * N)
    for topic in ("markers", "surface"):
        node.wait_until(lambda topic=topic: node.peer.node.count_publishers(topic), f"publisher of {topic}")
    for k in range(2):
        node.peer.vertices("cloth", sheet_positions(N, k), stamp=k, frame_id="world")
    message = node.contacts(1)[0]
    assert len(message.points) == 0, "the contacts carry points only where asked for (outputs)"
    (array,) = node.wait_until(lambda: markers, "markers")
    vertex_face, edge_edge, normals, *_ = array.markers
    assert len(vertex_face.points) + len(edge_edge.points) == 20 and len(normals.points) == 40
    assert vertex_face.header.frame_id == "world" and vertex_face.scale.x == 0.5
    (surface,) = node.wait_until(lambda: surfaces, "vertices for viewers")
    assert surface.header == vertex_face.header
    assert np.array_equal(mesh_messages.vertices_from_cloud(surface, N * N), sheet_positions(N, 1))


def test_markers_come_at_their_rate_only(start_node):
    node = start_node({"meshes": ["cloth"], "markers": True, "markers_rate": 0.001})
    markers = []
    node.peer.node.create_subscription(MarkerArray, "markers", markers.append, qos.MARKERS)
    node.peer.topology("cloth", FACES, N * N)
    node.wait_until(lambda: node.peer.node.count_publishers("markers"), "publisher of markers")
    for k in range(5):
        node.peer.vertices("cloth", sheet_positions(N, k), stamp=k)
        node.contacts(k)
    node.wait_until(lambda: markers, "markers")
    node.frames_status(processed=5)
    assert len(markers) == 1, "the next one would be due in a thousand seconds"


def test_simulated_time(start_node):
    """The node's own stamps are of /clock; frames are processed whether it runs or not."""
    node = start_node({"meshes": ["cloth"], "use_sim_time": True}, remaps=("/clock:=clock",))
    node.peer.topology("cloth", FACES, N * N)
    frames = [sheet_positions(N, k) for k in range(3)]
    for k in range(2):
        node.peer.vertices("cloth", frames[k], stamp=k)
    message = node.contacts(1)[0]
    assert_same_contacts(message, *frames[:2], scene_of(cloth=FACES))
    assert node.peer.reported_at == 0, "no /clock yet: simulated time is zero, and reports go on"
    clock = node.peer.publisher(Clock, "clock")
    for seconds in (1234, 5):  # a simulator that starts again goes back
        now = Clock(clock=fields.ns_to_stamp(seconds * 10**9))

        def told(now=now):
            clock.publish(now)  # again and again: /clock is read best effort
            return node.peer.reported_at == fields.stamp_to_ns(now.clock)

        node.wait_until(told, f"report at {seconds} s")
    node.peer.vertices("cloth", frames[2], stamp=2)
    assert fields.stamp_to_ns(node.contacts(2)[1].header.stamp) == 2, "stamps of results are those of the frames"


def test_meshes_at_rates_of_their_own(start_node):
    """The slower mesh is used again while it is the nearest; a frame without a near one is counted."""
    node = start_node(
        {"meshes": ["cloth", "net"], "stamp_match": "nearest", "stamp_tolerance": 15e-9, "frame_queue": 100}
    )
    for name in ("cloth", "net"):
        node.peer.topology(name, FACES, N * N)
    cloth = {10 * k: sheet_positions(N, k) for k in range(1, 8)}
    net = {stamp: sheet_positions(N, stamp, offset=0.004) for stamp in (12, 42, 95)}
    for stamp, vertices in net.items():
        node.peer.vertices("net", vertices, stamp)
    for stamp, vertices in cloth.items():
        node.peer.vertices("cloth", vertices, stamp)
    nearest = {10: 12, 20: 12, 30: 42, 40: 42, 50: 42}  # 60 and 70 are more than 15 ns away from 42 and 95
    node.frames_status(received=10, dropped=2, dropped__cloth__incomplete=2, waiting=1)
    assert "60 ns has no frame of net within the tolerance" in node.output()
    scene = scene_of(cloth=FACES, net=FACES)
    messages = node.contacts(4)
    for before, after, message in zip(list(nearest)[:-1], list(nearest)[1:], messages, strict=True):
        assert fields.stamp_to_ns(message.header.stamp) == after
        ends = (np.concatenate([cloth[stamp], net[nearest[stamp]]]) for stamp in (before, after))
        assert_same_contacts(message, *ends, scene)


def test_messages_beyond_the_rate_are_counted(start_node):
    node = start_node({"meshes": ["cloth"], "max_rate": 2.0, "input_depth": 100})
    node.peer.topology("cloth", FACES, N * N)
    for k in range(40):
        node.peer.vertices("cloth", sheet_positions(N, k % 4), stamp=k)
    values = node.wait_until(
        lambda: (v := node.peer.statuses["frames"][2])["received"] == "40" and v, "status with all messages"
    )
    rejected = int(values["dropped.cloth.rate"])
    assert 0 < rejected <= 38, "two at once are within the rate; how many more depends on how long sending took"
    assert "parameter max_rate" in values["last_rejection"]


def test_best_effort_input(start_node):
    node = start_node({"meshes": ["cloth"], "input_reliability": "best_effort"})
    node.peer.topology("cloth", FACES, N * N)
    sensor = qos.vertices("best_effort", 10)
    assert sensor.reliability == ReliabilityPolicy.BEST_EFFORT
    publisher = node.peer.publisher(MeshVertices, "meshes/cloth/vertices", sensor)
    sent = 0

    def shown():
        nonlocal sent  # frame after frame: each of them may be lost
        publisher.publish(mesh_messages.vertices_message(sheet_positions(N, sent), sent))
        sent += 1
        return node.peer.received

    message = node.wait_until(shown, "contacts")[0]
    start, end = (fields.stamp_to_ns(stamp) for stamp in (message.start, message.header.stamp))
    assert start < end
    assert_same_contacts(message, sheet_positions(N, start), sheet_positions(N, end), scene_of(cloth=FACES))


@pytest.mark.skipif("HPCCD_DATA" not in os.environ, reason="HPCCD_DATA is not set: no scenes with ground truth here")
def test_cloth_ball_through_the_node_gives_exactly_the_true_contacts(start_node):
    data = np.load(Path(os.environ["HPCCD_DATA"]) / "cloth-ball.npz")
    node = start_node({"meshes": ["cloth_ball"]})
    node.peer.topology("cloth_ball", data["faces"], len(data["vertices_t0"]))
    node.peer.vertices("cloth_ball", data["vertices_t0"], stamp=92)
    node.peer.vertices("cloth_ball", data["vertices_t1"], stamp=93)
    message = node.contacts(1)[0]
    layout = Layout(("cloth_ball",), np.array([0, len(data["vertices_t0"])]), np.array([0, len(data["faces"])]))
    got = contact_messages.read_contacts(message, layout)
    assert not message.truncated
    for name in ("vf", "ee"):
        order = np.lexsort(data[name].T[::-1])
        assert np.array_equal(getattr(got, name), data[name][order]), name
        assert np.allclose(getattr(got, f"{name}_toc"), data[f"{name}_toc"][order], rtol=0, atol=1e-9), name
