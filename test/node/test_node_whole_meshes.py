# SPDX-License-Identifier: Apache-2.0
"""Meshes that come as shape_msgs/Mesh or as markers of triangles: processed, rejected, recorded and computed again."""

import numpy as np
from bag_tools import replayed
from cloth_and_net import FACES, N
from hpccd.msg import MeshTopology
from node_process import assert_same_contacts
from rclpy.duration import Duration
from shape_msgs.msg import Mesh
from visualization_msgs.msg import Marker
from waving_sheet import scene_of, sheet_positions
from whole_meshes import marker_of, shape_of

from hpccd_core.mesh_files.welding import joined
from hpccd_core.rigid.transform import Rigid
from hpccd_ros.bag.reader import Recording
from hpccd_ros.bag.writer import BagWriter
from hpccd_ros.middleware import fields, mesh_messages, qos
from hpccd_ros.record import recorded_topics
from hpccd_ros.record.recorded_topics import recording_info
from hpccd_ros.record.topic_recorder import Recorder

# As the node numbers the corners of a marker: vertices in the order of their first use.
FIRST, VERTEX_OF = joined(sheet_positions(N, 0, dtype=np.float64)[FACES.reshape(-1)])
ORDER = FACES.reshape(-1)[FIRST]
WELDED = VERTEX_OF.reshape(-1, 3).astype(np.uint32)


def sheet(k, offset=0.0):
    return sheet_positions(N, k, offset=offset, dtype=np.float64)


def send(node, kind, message, mesh="cloth"):
    node.peer.publisher(type(message), f"meshes/{mesh}/{kind}").publish(message)


def test_a_stream_of_markers(start_node, tmp_path, hpccd):
    path, late = tmp_path / "run.mcap", tmp_path / "late.mcap"
    node = start_node({"meshes": ["cloth"], "mesh": {"cloth": {"input": "marker"}}, "record": str(path)})
    for k in range(4):
        send(node, "marker", marker_of(sheet(k), FACES, stamp=k + 1, frame_id="world"))
        node.frames_status(processed=k + 1)
    for k, response in enumerate(node.contacts(3), start=1):
        assert assert_same_contacts(response, sheet(k - 1)[ORDER], sheet(k)[ORDER], scene_of(cloth=WELDED)) > 0
        assert (response.header.frame_id, fields.stamp_to_ns(response.header.stamp)) == ("world", k + 1)
    assert len({tuple(response.topology_versions) for response in node.peer.received}) == 1

    # Another recorder comes in the middle, when all that the node knows of the topology was sent before.
    parameters = {"meshes": ["cloth"], "mesh.cloth.input": "marker"}
    wanted = recorded_topics.of_node(parameters)
    peer = node.peer.node
    bag = BagWriter(late, info=recording_info("/hpccd", parameters, wanted, peer.resolve_topic_name))
    recorder = Recorder(peer, bag, wanted, 100)
    node.peer.readers = 3
    node.peer.await_readers("meshes/cloth/marker")
    node.wait_until(lambda: recorder.publishers(f"{node.namespace}/contacts"), "the second recorder to hear")

    # A rejected message does not change processed ones.
    stop = marker_of(sheet(4), FACES, stamp=5, frame_id="world")
    stop.action = Marker.DELETE
    send(node, "marker", stop)
    cube = marker_of(sheet(4), FACES, stamp=5, frame_id="world")
    cube.type = Marker.CUBE
    send(node, "marker", cube)
    values = node.frames_status(dropped__cloth__unsupported_type=2)
    assert "marker of type 1; only TRIANGLE_LIST (11) is a mesh" in values["last_rejection"]
    topology = node.peer.publisher(MeshTopology, "meshes/cloth/topology", qos.TOPOLOGY)
    topology.publish(mesh_messages.topology_message(FACES, N * N, version=3))
    assert topology.wait_for_all_acked(Duration(seconds=60))
    node.frames_status(topologies_rejected__cloth__topology_conflict=1)
    for k in (4, 5):
        send(node, "marker", marker_of(sheet(k), FACES, stamp=k + 1, frame_id="world"))
        node.frames_status(processed=k + 1)
    response = node.contacts(5)[-1]
    assert_same_contacts(response, sheet(4)[ORDER], sheet(5)[ORDER], scene_of(cloth=WELDED))
    assert response.topology_versions == node.peer.received[0].topology_versions

    # Half of the sheet is another mesh: its first frame is only a start.
    half = FACES[: len(FACES) // 2]
    first, vertex_of = joined(sheet(6)[half.reshape(-1)])
    order, welded = half.reshape(-1)[first], vertex_of.reshape(-1, 3).astype(np.uint32)
    for k in (6, 7):
        send(node, "marker", marker_of(sheet(k), half, stamp=k + 1, frame_id="world"))
        node.frames_status(processed=k + 1)
    response = node.contacts(6)[-1]
    assert_same_contacts(response, sheet(6)[order], sheet(7)[order], scene_of(cloth=welded))
    assert response.topology_versions != node.peer.received[0].topology_versions
    node.wait_until(
        lambda: recorder.received[f"{node.namespace}/contacts"] == 3, "three responses in the late recording"
    )
    bag.close()
    assert node.stop() == 0

    replay, _ = replayed(path)
    assert (replay.verified, replay.diverged, replay.unverified) == (6, 0, 0)
    replay, _ = replayed(late)
    assert (replay.verified, replay.diverged, replay.unverified) == (2, 0, 0)
    done = hpccd("replay", path)
    assert done.returncode == 0 and "VERIFIED: 6 results are equal" in done.stdout, done.stdout + done.stderr
    assert hpccd("doctor", path).returncode == 0
    drawn = hpccd("view", path, "-o", tmp_path / "step.png")
    assert drawn.returncode == 0, drawn.stderr


def test_a_stream_of_shapes_within_a_room_of_one(start_node, tmp_path):
    """A shape has no stamp: that of a response is when its publisher sent it, which each reader is told alike."""
    path = tmp_path / "run.mcap"
    room = sheet(9, offset=0.004)
    meshes = {"cloth": {"input": "shape"}, "room": {"input": "shape", "static": True, "self_collision": False}}
    node = start_node({"meshes": ["cloth", "room"], "mesh": meshes, "record": str(path)})
    send(node, "shape", shape_of(room, FACES), mesh="room")
    node.frames_status(processed=1)
    for k in range(4):
        send(node, "shape", shape_of(sheet(k), FACES))
        node.frames_status(processed=k + 2)
    scene = scene_of(cloth=FACES)
    scene.add_mesh("room", FACES, n_vertices=N * N, static=True, self_collision=False)
    responses = node.contacts(3)
    for k, response in enumerate(responses, start=1):
        frames = [np.concatenate([sheet(s), room]) for s in (k - 1, k)]
        assert assert_same_contacts(response, *frames, scene) > 0
    stamps = [fields.stamp_to_ns(response.header.stamp) for response in responses]
    wrong = shape_of(sheet(0), FACES)
    wrong.triangles[3].vertex_indices[1] = N * N
    send(node, "shape", wrong)
    values = node.frames_status(dropped__cloth__index_range=1)
    assert f"triangle 3 names vertex {N * N}, the mesh has {N * N} vertices" in values["last_rejection"]
    assert node.stop() == 0
    replay, _ = replayed(path)
    assert (replay.verified, replay.diverged, replay.unverified) == (3, 0, 0)
    with Recording(path) as recording:
        topic = f"{node.namespace}/meshes/cloth/shape"
        sent = [message.publish_time for message in recording.messages([topic])]
    assert sent[1:4] == stamps


def test_a_marker_in_a_frame_of_its_own(start_node):
    """Its pose, then the transform of the mesh; and any input with a file is one topology too many."""
    rigid = Rigid.of((1, 2, 3), (0, 0, 0.6, 0.8))
    pose = [*rigid.shift.tolist(), *rigid.quaternion.tolist()]
    given = {"input": "marker", "transform": "pose", "pose": pose, "frame": "hand"}
    node = start_node({"meshes": ["cloth"], "frame_id": "world", "mesh": {"cloth": given}})
    local = Rigid.of((0, 0, 1), (0.8, 0, 0, 0.6))
    for k in range(2):
        message = marker_of(sheet(k), FACES, stamp=k + 1, frame_id="hand")
        message.pose.position.z = 1.0
        message.pose.orientation.x, message.pose.orientation.w = 0.8, 0.6
        send(node, "marker", message)
        node.frames_status(processed=k + 1)
    placed = [rigid.apply(local.apply(sheet(k)[ORDER])) for k in range(2)]
    assert_same_contacts(node.contacts(1)[0], *placed, scene_of(cloth=WELDED))


def test_a_file_beside_whole_meshes_is_rejected(start_node):
    node = start_node({"meshes": ["a"], "mesh": {"a": {"input": "shape", "file": "a.obj"}}}, wait=False)
    assert node.process.wait(timeout=60) == 2
    assert "mesh.a.file: with mesh.a.input shape each message carries the triangles" in node.output()


def test_unknown_meshes_are_noticed(start_node):
    node = start_node({"meshes": ["cloth"]})
    publishers = [
        node.peer.node.create_publisher(kind, f"meshes/rag/{topic}", 10)
        for kind, topic in ((Mesh, "shape"), (Marker, "marker"))
    ]
    node.wait_until(lambda: all(p.get_subscription_count() for p in publishers), "the node to listen")
    publishers[0].publish(shape_of(sheet(0), FACES))
    publishers[1].publish(marker_of(sheet(0), FACES))
    node.frames_status(dropped__rag__unknown_mesh=2)
