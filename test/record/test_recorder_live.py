# SPDX-License-Identifier: Apache-2.0
"""Recordings made over DDS: complete, readable by others, and computed again to the same contacts."""

import signal
import time

import numpy as np
import pytest
import rclpy
from bag_tools import read_by_mcap_ros2, read_by_rosbags, replayed, typestore
from live import PATIENCE, Live
from rclpy.executors import SingleThreadedExecutor
from rosbags.rosbag2 import Reader

from hpccd_ros import scenes
from hpccd_ros.bag.reader import Recording
from hpccd_ros.middleware import environment
from hpccd_ros.middleware.message_types import message_class

FRAMES = 30
OUTPUTS = 'outputs:=["points", "normals"]'


@pytest.fixture
def live(children, namespace, tmp_path):
    return Live(children, namespace, tmp_path, frames=FRAMES)


def _record(live, path, *options, stop=signal.SIGINT, node_options=(), publisher_options=()):
    node = live.node(*node_options)
    recorder = live.recorder(path, *options)
    live.wait_for(live.publisher(*publisher_options))
    live.wait_for_results(path, FRAMES - 1)
    recorder.process.send_signal(stop)
    live.wait_for(recorder)
    live.end(node)
    return recorder


def _verified(path):
    replay, steps = replayed(path)
    assert replay.diverged == replay.unverified == 0
    return steps


@pytest.mark.parametrize("stop", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.long)])
def test_recorded_live_read_by_others_and_verified(live, namespace, tmp_path, stop):
    path = tmp_path / "run.mcap"
    known = f"{namespace}/contacts=hpccd/msg/ContactArray"
    recorder = _record(live, path, "--topic", known, stop=stop, node_options=(OUTPUTS,))
    assert "LOST" not in recorder.last_words() and recorder.has_printed("recorded ")
    assert recorder.has_printed(": 7 topics, ")
    assert recorder.has_printed(f"  no message: {namespace}/distances, {namespace}/pairs\n")

    steps = _verified(path)
    assert [step.step for step in steps] == list(range(1, FRAMES)), "every step is recorded and verified"
    assert all(list(step.recorded.topology_versions) == [0, 0] for step in steps)

    scene = scenes.make("cloth-drop", size=0.1, frames=FRAMES)
    messages = read_by_rosbags(path)
    by_topic = {}
    for topic, _, _, message in messages:
        by_topic.setdefault(topic, []).append(message)
    assert set(by_topic) == {
        f"{namespace}/{name}"
        for name in (
            "meshes/cloth/topology",
            "meshes/cloth/vertices",
            "meshes/ball/topology",
            "meshes/ball/vertices",
            "contacts",
        )
    }
    for index, mesh in enumerate(scene.meshes):
        (topology,) = by_topic[f"{namespace}/meshes/{mesh.name}/topology"]
        assert np.array_equal(topology.faces.reshape(-1, 3), mesh.faces)
        vertices = by_topic[f"{namespace}/meshes/{mesh.name}/vertices"]
        for frame, message in zip(scene.frames(), vertices, strict=True):
            assert np.array_equal(message.vertices_f32.reshape(-1, 3), frame[index]), "bit for bit what was sent"
    contacts = by_topic[f"{namespace}/contacts"]
    assert [message.hash for message in contacts] == [step.contacts.hash for step in steps]
    assert sum(message.total for message in contacts) > 0
    assert all(len(message.points) == len(message.normals) == 3 * message.total for message in contacts)

    # A second independent reader finds the same.
    others = read_by_mcap_ros2(path)
    assert [(topic, kind, at) for topic, kind, at, _ in others] == [(t, k, at) for t, k, at, _ in messages]
    assert [m.hash for t, _, _, m in others if t.endswith("/contacts")] == [m.hash for m in contacts]

    with Recording(path) as recording:
        topic = recording.topics[f"{namespace}/contacts"]
        assert topic.type_hash == typestore().hash_rihs01("hpccd/msg/ContactArray")
        assert "durability: transient_local" in recording.topics[f"{namespace}/meshes/cloth/topology"].offered_qos
        assert recording.info["parameters"]["meshes"] == ["cloth", "ball"]
        times = [message.log_time for message in recording.messages()]
        assert all(m.publish_time <= m.log_time for m in recording.messages())
    assert times == sorted(times) and abs(times[-1] * 1e-9 - time.time()) < 3600


def test_split_and_compressed(live, tmp_path):
    path = tmp_path / "run"
    # Slowly, so that results of a busy node lie in the same file as their frames.
    options = ("--split-size", "0.04", "--compression", "zstd")
    _record(live, path, *options, stop=signal.SIGTERM, publisher_options=["--rate", "8"])
    files = sorted(path.glob("*.mcap"))
    assert len(files) > 2
    with Reader(path) as reader:
        assert reader.message_count == sum(1 for _ in reader.messages())
    assert len(_verified(path)) == FRAMES - 1
    # Each file alone: the steps whose both frames it holds. A split may fall between a frame and its result; a file
    # without any result, as the first one of a busy machine, is computed from frame to frame.
    for file in files:
        compared = [step for step in _verified_file(file) if step.recorded is not None]
        assert sum(step.missing is None for step in compared) == _whole_steps(file)
    assert sum(map(_whole_steps, files)) > 0


def _whole_steps(file) -> int:
    """Results in the file whose both frames are in it too, as another reader finds them."""
    stamp = lambda time: (time.sec, time.nanosec)  # noqa: E731
    messages = [(topic.rpartition("/")[2], topic, message) for topic, _, _, message in read_by_rosbags(file)]
    frames = {}
    for kind, topic, message in messages:
        if kind == "vertices":
            frames.setdefault(topic, set()).add(stamp(message.header.stamp))
    whole = set.intersection(*frames.values()) if len(frames) == 2 else set()
    results = [message for kind, _, message in messages if kind == "contacts"]
    return sum({stamp(result.start), stamp(result.header.stamp)} <= whole for result in results)


def _verified_file(file):
    replay, steps = replayed(file)
    assert replay.diverged == 0
    return steps


def _frames_from(path, seconds: float) -> int:
    """How many whole frames (cloth and ball) a player publishes that begins this many seconds into the recording."""
    with Recording(path) as recording:
        messages = [(message.topic, message.log_time) for message in recording.messages()]
    begin = messages[0][1] + seconds * 1e9
    return min(
        sum(topic == f"/meshes/{mesh}/vertices" and at >= begin for topic, at in messages) for mesh in ("cloth", "ball")
    )


def test_played_back_over_dds_gives_the_same_contacts(live, small_bag, tmp_path, children):
    """Recording -> player -> a fresh node -> recorder: the results are those of the first recording."""
    again = tmp_path / "again.mcap"
    # The recording has absolute names in the root namespace: the node listens there by remapping.
    rules = [
        f"{relative}:=/{relative}"
        for mesh in ("cloth", "ball")
        for relative in (f"meshes/{mesh}/topology", f"meshes/{mesh}/vertices")
    ]
    remaps = [word for rule in rules for word in ("-r", rule)]
    node = children.start(
        "node",
        "hpccd_ros.node",
        *live._remap,
        *remaps,
        "--params-file",
        str(live.parameters),
        "-p",
        "accuracy:=exact",
        "-p",
        "frame_queue:=1000",
        "-p",
        "input_depth:=1000",
    )
    children.wait(lambda: node.has_printed("active: meshes"), "the node was not active", PATIENCE)
    recorder = live.recorder(again, "--ros-args", *remaps)
    live.wait_for(live.play(small_bag, "--rate", "2", "--from", "1.0"))
    live.wait_for_results(again, _frames_from(small_bag, 1.0) - 1)
    live.end(recorder)
    live.end(node)

    steps = _verified(again)
    first = {step.end: step.recorded.hash for step in _verified(small_bag)}
    assert len(steps) > 50
    assert [step.recorded.hash for step in steps] == [first[step.end] for step in steps]
    with Recording(again) as recording:
        assert set(recording.info["topics"].values()) >= {"meshes/cloth/vertices", "contacts"}


def test_recorder_without_a_node_says_so(hpccd, namespace, tmp_path):
    done = hpccd("record", "-o", "x.mcap", "--node", f"{namespace}/hpccd", "--wait", "0.5")
    assert done.returncode == 2 and f"no node {namespace}/hpccd found" in done.stderr
    assert not (tmp_path / "x.mcap").exists()


def test_player_without_listeners_says_so(hpccd, small_bag):
    done = hpccd("replay", small_bag, "--publish", "--wait", "0.5")
    assert done.returncode == 2 and "nobody subscribes to /meshes/" in done.stderr and "waiting" not in done.stderr
    done = hpccd("replay", small_bag, "--publish", "--wait", "1.2")
    waits, says = done.stderr.splitlines()
    assert waits.startswith("waiting for subscribers of /meshes/") and waits.endswith(", 1.2 s at most (--wait)")
    assert done.returncode == 2 and "nobody subscribes to /meshes/" in says


def test_mesh_file_travels_with_the_recording(children, namespace, tmp_path):
    """A static mesh from a file: the replay needs neither the file nor its place."""
    trimesh = pytest.importorskip("trimesh")
    file = tmp_path / "floor.stl"
    trimesh.creation.box(extents=(4, 4, 0.2)).export(file)
    live = Live(children, namespace, tmp_path, frames=FRAMES)
    text = live.parameters.read_text().replace("- ball", "- ball\n    - floor")
    text += (
        f"    mesh.floor.file: {file}\n    mesh.floor.static: true\n"
        "    mesh.floor.pose: [0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 1.0]\n"
    )
    live.parameters.write_text(text)
    path = tmp_path / "run.mcap"
    _record(live, path)
    file.unlink()
    steps = _verified(path)
    assert len(steps) == FRAMES - 1
    assert steps[0].layout.mesh_names == ("cloth", "ball", "floor")
    assert sum(step.total for step in steps) > 0


def test_results_are_played(children, small_bag):
    with Recording(small_bag) as recording:
        topics = recording.topics.values()
        begin = next(recording.messages()).log_time
        expected = sum(message.log_time <= begin + 500_000_000 for message in recording.messages(["/contacts"]))
    received = []
    environment.prepare()
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("listener", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    for topic in topics:
        take = received.append if topic.name == "/contacts" else lambda message: None
        node.create_subscription(message_class(topic.type_name), topic.name, take, 1000)

    def all_there():
        executor.spin_once(timeout_sec=0.05)
        return len(received) == expected

    options = ("--publish", "--all", "--to", "0.5", "--wait", str(PATIENCE))
    children.start("player", "hpccd_ros.cli", "replay", str(small_bag), *options)
    children.wait(all_there, f"{expected} results were not heard", PATIENCE)
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown(context=context)
    assert expected > 5
    assert [message.hash for message in received] == [step.recorded.hash for step in _verified(small_bag)][:expected]
    assert all(message.backend == "cpu" and list(message.topology_versions) == [0, 0] for message in received)
