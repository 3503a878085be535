# SPDX-License-Identifier: Apache-2.0
"""Recordings of a mesh in a frame that moves: they hold the transforms, and are computed again to the same contacts."""

import subprocess
import sys

import numpy as np
import pytest
from bag_tools import replayed
from geometry_msgs.msg import TransformStamped
from mesh_in_a_hand import FACES, SCENE, SECOND, N, topologies, transform
from node_process import PATIENCE, assert_same_contacts
from waving_sheet import scene_of, sheet_positions

from hpccd_core.rigid.transform import Rigid
from hpccd_ros.bag.reader import Recording, RecordingError
from hpccd_ros.bag.writer import BagWriter, Topic
from hpccd_ros.frames.transform_buffer import TransformBuffer
from hpccd_ros.middleware import qos
from hpccd_ros.record import recorded_topics
from hpccd_ros.record.recorded_topics import recording_info
from hpccd_ros.record.topic_recorder import Recorder
from hpccd_ros.replay import recorded_setup

STEPS = 12
NET = {"transform": "tf", "frame": "hand"}
FLAT = {**SCENE, **{f"mesh.net.{name}": value for name, value in NET.items()}}
STATIC = [
    ("world", "arm", Rigid.of((0.1, 0.2, 0.3), (0.0, 0.6, 0.0, 0.8))),
    ("arm", "wrist", Rigid.of((-0.1, 0.0, 0.2), (0.6, 0.0, 0.0, 0.8))),
]


def hand(second):
    """In the wrist."""
    half = 0.4 + 0.03 * second
    return Rigid.of((0.3 + 0.01 * second, -0.2, 0.1), (0.0, 0.0, np.sin(half), np.cos(half)))


def placed(k):
    """What takes the hand to the world at frame k, half a second behind a transform."""
    buffer = TransformBuffer()
    moving = [("wrist", "hand", hand(second), second * SECOND) for second in (k, k + 1)]
    for parent, child, rigid, stamp in [*((*edge, None) for edge in STATIC), *moving]:
        buffer.add(parent, child, Rigid.of(rigid.shift, rigid.quaternion), stamp)  # as it is read from a message
    return buffer.lookup("hand", "world", k * SECOND + SECOND // 2)


def parts(k):
    """The cloth in the scene's frame, the net in that of the hand."""
    return sheet_positions(N, k), placed(k).inverse().apply(sheet_positions(N, k + 2, offset=0.003, dtype=np.float64))


def stream(node, steps, publish, publish_static):
    """Frames, each before the later one of the two transforms between which it lies."""
    for edge in STATIC:
        publish_static(transform(*edge))
    publish(transform("wrist", "hand", hand(0), 0))
    for k in range(steps):
        for name, frame_id, vertices in zip(("cloth", "net"), ("world", ""), parts(k), strict=True):
            node.peer.vertices(name, vertices, k * SECOND + SECOND // 2, step=k, frame_id=frame_id)
        publish(transform("wrist", "hand", hand(k + 1), (k + 1) * SECOND))
        node.contacts(k)
    for k, message in enumerate(node.contacts(steps - 1), start=1):
        frames = [(cloth, placed(s).apply(net)) for s in (k - 1, k) for cloth, net in [parts(s)]]
        assert assert_same_contacts(message, *map(np.concatenate, frames), scene_of(cloth=FACES, net=FACES)) > 0


def of_geometry_msgs(node):
    publisher = node.peer.publisher(TransformStamped, "transforms", qos.TRANSFORMS)
    static = node.peer.publisher(TransformStamped, "transforms_static", qos.TRANSFORMS_STATIC)
    return publisher.publish, static.publish


of_geometry_msgs.names = ("transforms", "transforms_static")


def of_tf2(node):
    tf2 = pytest.importorskip("tf2_msgs.msg", reason="tf2_msgs is not installed: /tf is not understood")
    publisher = node.peer.publisher(tf2.TFMessage, "/tf", qos.TRANSFORMS)
    static = node.peer.publisher(tf2.TFMessage, "/tf_static", qos.TRANSFORMS_STATIC)
    return (
        lambda message: publisher.publish(tf2.TFMessage(transforms=[message])),
        lambda message: static.publish(tf2.TFMessage(transforms=[message])),
    )


def compared(path):
    replay, steps = replayed(path)
    assert replay.diverged == 0, replay.first_divergence.difference
    return replay, steps


of_tf2.names = ("/tf", "/tf_static")


@pytest.mark.parametrize("topics", [of_geometry_msgs, of_tf2])
def test_verified_from_the_file(start_node, tmp_path, topics):
    """From the node's own recording, and from one in several files by the recorder of `hpccd record`."""
    own, other = tmp_path / "own.mcap", tmp_path / "other"
    node = start_node({**SCENE, "mesh": {"net": NET}, "record": str(own)})
    wanted = recorded_topics.of_node(FLAT)
    resolve = node.peer.node.resolve_topic_name
    info = recording_info(f"{node.namespace}/hpccd", FLAT, wanted, resolve)
    bag = BagWriter(other, info=info, max_bytes=200_000)
    recorder = Recorder(node.peer.node, bag, wanted, 100)
    node.wait_until(lambda: recorder.publishers(resolve("contacts")), "matching")
    node.peer.readers = 3
    publishers = topics(node)
    topologies(node)
    stream(node, STEPS, *publishers)
    complete = {"meshes/cloth/vertices": STEPS, "meshes/net/vertices": STEPS, "contacts": STEPS - 1}
    complete |= dict(zip(topics.names, (STEPS + 1, len(STATIC)), strict=True))
    node.wait_until(
        lambda: all(recorder.received[resolve(name)] == count for name, count in complete.items()), "other recording"
    )
    bag.close()
    assert node.stop() == 0

    for path in (own, other):
        replay, steps = compared(path)
        assert (replay.verified, replay.unverified) == (STEPS - 1, 0)
        assert [step.recorded.hash for step in steps] == [message.hash for message in node.peer.received]
    alone = [compared(file)[0].verified for file in sorted(other.glob("*.mcap"))]
    assert len(alone) > 2 and all(alone[:-1]), "each file has the static transforms in force"


def test_played_over_dds(start_node, tmp_path):
    path, steps = tmp_path / "run.mcap", 6
    node = start_node({**SCENE, "mesh": {"net": NET}, "record": str(path)})
    publishers = of_geometry_msgs(node)
    topologies(node)
    stream(node, steps, *publishers)
    assert node.stop() == 0
    names = [wanted.name for wanted in recorded_topics.of_node(FLAT) if wanted.name[0] != "/"]
    rules = tuple(f"{name}:={node.namespace}/{name}" for name in names if name != "contacts")
    queues = {"frame_queue": 100, "input_depth": 100, "pending_frames": 100}
    again = start_node({**SCENE, "mesh": {"net": NET}, **queues}, remaps=rules)
    player = ["hpccd_ros.cli", "replay", str(path), "--publish", "--wait", str(PATIENCE)]
    done = subprocess.run([sys.executable, "-m", *player], capture_output=True, text=True, timeout=2 * PATIENCE)
    assert done.returncode == 0, done.stderr
    assert [m.hash for m in again.contacts(steps - 1)] == [m.hash for m in node.peer.received]


def test_without_transforms_says_so(tmp_path):
    wanted = [topic for topic in recorded_topics.of_node(FLAT) if topic.name.startswith("meshes")]
    path = tmp_path / "cut.mcap"
    bag = BagWriter(path, info=recording_info("/hpccd", FLAT, wanted, lambda name: f"/{name}"))
    for topic in wanted:
        bag.add_topic(Topic(f"/{topic.name}", topic.type_name, []))
    bag.close()
    with Recording(path) as recording, pytest.raises(RecordingError, match="transforms .*has none"):
        recorded_setup.of_recording(recording)
