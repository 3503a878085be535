# SPDX-License-Identifier: Apache-2.0
"""The node records itself: the bytes that any recorder hears, begun and ended by a parameter, never at its own cost."""

import random
import resource
import signal

import numpy as np
import pytest
import stop_stream
from lifecycle_msgs.msg import Transition
from node_calls import change_state, set_parameter, stream
from node_process import PATIENCE, NodeProcess
from rclpy.serialization import deserialize_message
from std_msgs.msg import Bool
from waving_sheet import sheet_faces, sheet_positions

from hpccd_ros.bag.examine import examine
from hpccd_ros.bag.reader import Recording
from hpccd_ros.bag.recover import recover
from hpccd_ros.bag.writer import BagWriter
from hpccd_ros.node import node_recording
from hpccd_ros.record import recorded_topics
from hpccd_ros.record.topic_recorder import Recorder
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay

N = 8
FACES = sheet_faces(N)


def _replayed(path):
    with Recording(path) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording))
        steps = list(replay.steps())
    assert replay.diverged == replay.unverified == 0
    return steps


def _messages(path):
    with Recording(path) as recording:
        return [(m.topic, m.publish_time, m.sequence, m.data) for m in recording.messages()]


def _recording(node, **expected):
    """Wait until the status `recording` holds these values; (level, values)."""

    def matches():
        level, _, values = node.peer.statuses.get("recording", (b"", "", {}))
        return {k: str(v) for k, v in expected.items()}.items() <= values.items() and (level, values)

    return node.wait_until(matches, f"recording status with {expected}")


def _flushed(node, least):
    """Condition: how many messages the node says it has flushed, once they are `least`."""
    return lambda: (n := int(node.peer.statuses["recording"][2]["flushed"])) >= least and n


def test_the_bytes_that_another_recorder_hears(start_node, tmp_path):
    node = start_node({"meshes": ["cloth"], "outputs": ["points"], "record": str(tmp_path / "own.mcap")})
    other = BagWriter(tmp_path / "other.mcap")
    recorder = Recorder(node.peer.node, other, recorded_topics.of_node({"meshes": ["cloth"]}), 100)
    node.peer.readers = 3
    node.peer.topology("cloth", FACES, N * N)
    node.wait_until(lambda: all(recorder.publishers(t) for t in recorder.topics if "vertices" not in t), "matching")
    stream(node, range(20))
    node.wait_until(lambda: sum(recorder.received.values()) == 1 + 20 + 19, "the other recording")
    other.close()
    level, values = _recording(node, messages=40)
    assert level == b"\0" and int(values["lost"]) == int(values["not_written"]) == int(values["write_errors"]) == 0
    assert node.stop() == 0

    own = _messages(tmp_path / "own.mcap")
    assert sorted(own) == sorted(_messages(tmp_path / "other.mcap"))
    assert len(own) == 40
    assert [step.total > 0 for step in _replayed(tmp_path / "own.mcap")] == [True] * 19
    with Recording(tmp_path / "own.mcap") as recording:
        assert recording.info["node"] == f"{node.namespace}/hpccd"
        assert recording.info["parameters"]["outputs"] == ["points"]


def test_stop_is_recorded_and_is_no_input_of_a_replay(start_node, hpccd, tmp_path):
    path = tmp_path / "own.mcap"
    with stop_stream.started(start_node, record=str(path)) as stream:
        stream.start()
        stream.frame(stop_stream.NEAR)
        stream.expect(True)
        topic = f"{stream.node.namespace}/stop"
        assert stream.node.stop() == 0
    assert len(_replayed(path)) == 2
    with Recording(path) as recording:
        said = [deserialize_message(m.data, Bool).data for m in recording.messages() if m.topic == topic]
        assert topic not in recorded_setup.of_recording(recording).roles
    since_false = said[said.index(False) :]
    assert since_false == sorted(since_false) and since_false[-1], "false, then true"
    # A listener would take a recorded false for a present one.
    played = hpccd("replay", str(path), "--publish", "--all", "--subscribers", "0", "--wait", "0", "--rate", "0")
    assert played.returncode == 0 and f"{topic} is not published" in played.stdout + played.stderr
    assert f" on {len(recording.topics) - 1} topics" in played.stdout


def test_begun_and_ended_at_run_time(start_node, tmp_path):
    """By the parameter, and by the life cycle; each recording is complete alone and none is overwritten."""
    node = start_node({"meshes": ["cloth"], "record_compression": "zstd"})
    node.peer.topology("cloth", FACES, N * N)
    stream(node, range(5))
    assert not list(tmp_path.glob("*.mcap")) and "recording" not in node.peer.statuses
    assert set_parameter(node, "record", str(tmp_path / "part-%Y.mcap")).successful
    _recording(node, files=1)
    # The topology, sent long ago, is latched: it comes to the recorder, then frames can be used.
    _recording(node, messages=1)
    node.peer.readers = 2
    node.peer.await_readers("meshes/cloth/vertices")
    stream(node, range(5, 10))
    _recording(node, messages=1 + 5 + 5)
    assert set_parameter(node, "record", "").successful
    (first,) = tmp_path.glob("part-2*.mcap")
    stream(node, range(10, 12))
    assert set_parameter(node, "record", str(first)).successful
    _recording(node, messages=1)
    assert change_state(node, Transition.TRANSITION_DEACTIVATE)
    second = first.with_name(f"{first.stem}-1.mcap")
    assert examine(first).sound and examine(second).sound
    assert [step.step for step in _replayed(first)] == [0] * 5
    rejected = set_parameter(node, "record", str(first / "no" / "folder"))
    assert not rejected.successful and f"the folder {first} is not writable" in rejected.reason
    rejected = set_parameter(node, "record_split_size", 1.0)
    assert not rejected.successful and "cannot split the single file" in rejected.reason


def test_a_full_disk_stops_only_the_recording(start_node, tmp_path):
    node = start_node({"meshes": ["cloth"], "record": str(tmp_path / "run"), "record_flush": 0.0})
    node.peer.topology("cloth", FACES, N * N)
    stream(node, range(5))
    _recording(node, messages=1 + 5 + 4)
    limit = resource.prlimit(node.process.pid, resource.RLIMIT_FSIZE)
    resource.prlimit(node.process.pid, resource.RLIMIT_FSIZE, (10_000, limit[1]))
    stream(node, range(5, 25))
    level, values = node.wait_until(
        lambda: (s := node.peer.statuses["recording"])[0] == b"\2" and (s[1], s[2]), "an error of the recording"
    )
    assert "File too large" in level and int(values["write_errors"]) >= 1
    # The detection went on: `stream` waits for each result. With space, the recording does too.
    resource.prlimit(node.process.pid, resource.RLIMIT_FSIZE, limit)
    before = int(values["messages"])
    for k in range(25, 2000):
        stream(node, [k])
        level, _, values = node.peer.statuses["recording"]
        if level == b"\1" and int(values["messages"]) > before + 20:
            break
        node.peer.executor.spin_once(timeout_sec=0.05)
    assert node.stop() == 0
    files = sorted((tmp_path / "run").glob("*.mcap"))
    sound = [file for file in files if examine(file).sound]
    assert sound and len(sound) < len(files)
    assert len(_replayed(sound[-1])) > 5


def test_where_nothing_can_be_recorded(start_node, tmp_path):
    (tmp_path / "file").write_text("")
    node = start_node({"meshes": ["cloth"], "record": str(tmp_path / "file" / "run.mcap")}, wait=False)
    assert node.process.wait(PATIENCE) == 2
    assert "is not writable" in node.output()


IMPOSSIBLE = {
    "root": ("/", "give the name of a file"),
    "here": (".", "give the name of a file"),
    "parent": ("..", "give the name of a file"),
    "nobody": ("~nosuchuser/x.mcap", "home directory"),
    "long name": ("{folder}/" + "x" * 300 + ".mcap", "255 bytes"),
    "name without room for a number": ("{folder}/" + "x" * 250, "255 bytes"),
    "long folder": ("{folder}/" + "x" * 300 + "/run.mcap", "File name too long"),
    "levels": ("{folder}/" + "d/" * 2000 + "run.mcap", "2,000 missing folders on the way"),
    "long path": ("{folder}/" + ("d" * 200 + "/") * 30 + "run.mcap", "File name too long"),
    "nul": ("{folder}/a\0b.mcap", "null"),
    "no text": ("{folder}/\udc80\ud800.mcap", "surrogates"),
}


def _settings_with(record):
    return {"record": record, "record_compression": "none", "record_split_size": 0.0, "record_split_time": 0.0}


@pytest.mark.parametrize("record, why", IMPOSSIBLE.values(), ids=IMPOSSIBLE)
def test_impossible_places_are_rejected_with_a_reason(tmp_path, record, why):
    rejected = node_recording.unrecordable(_settings_with(record.format(folder=tmp_path)))
    assert rejected.startswith("record: ") and why in rejected and len(rejected) < 400, rejected


def test_a_running_node_rejects_them_too(start_node, tmp_path):
    """Those that can be sent: DDS has no strings with a NUL or half a character."""
    node = start_node({"meshes": ["cloth"]})
    for name in IMPOSSIBLE.keys() - {"nul", "no text"}:
        record, why = IMPOSSIBLE[name]
        rejected = set_parameter(node, "record", record.format(folder=tmp_path))
        assert not rejected.successful and why in rejected.reason, (name, rejected.reason)
    node.peer.topology("cloth", FACES, N * N)
    stream(node, range(2))
    assert set_parameter(node, "record", str(tmp_path / ("x" * 230) / "run.mcap")).successful
    _recording(node, files=1)
    assert node.stop() == 0 and "Traceback" not in node.output()


@pytest.mark.parametrize("record", ["/", "~nosuchuser/x.mcap"])
def test_a_node_is_not_started_with_them(start_node, record):
    node = start_node({"meshes": ["cloth"], "record": record}, wait=False)
    assert node.process.wait(PATIENCE) == 2
    assert "hpccd: record: " in node.output() and "Traceback" not in node.output()


@pytest.mark.parametrize("compression", ["none", "zstd"])
def test_killed_node_keeps_what_was_flushed(tmp_path, compression):
    generator = random.Random(7)
    for number in range(2):
        path = tmp_path / f"run{number}.mcap"
        node = NodeProcess(
            tmp_path,
            {"meshes": ["cloth"], "record": str(path), "record_flush": 0.1, "record_compression": compression},
        )
        try:
            node.peer.topology("cloth", FACES, N * N)
            stream(node, range(generator.randrange(10, 60)))
            flushed = node.wait_until(_flushed(node, 10), "messages flushed")
            node.stop(signal.SIGKILL)
        finally:
            node.close()
        found = examine(path)
        assert not found.finished and found.message_count >= flushed
        recover(path, tmp_path / f"saved{number}.mcap")
        _replayed(tmp_path / f"saved{number}.mcap")


@pytest.mark.parametrize(("flush", "sync"), [(0.2, True), (3600.0, False)])
def test_flush_alone_closes_a_chunk(tmp_path, flush, sync):
    """`record_flush` also holds while no message comes; without it, the open chunk is lost with a killed node."""
    path = tmp_path / "run.mcap"
    node = NodeProcess(tmp_path, {"meshes": ["cloth"], "record": str(path), "record_flush": flush, "record_sync": sync})
    try:
        node.peer.topology("cloth", FACES, N * N)
        stream(node, range(10))
        _, values = _recording(node, messages=20)  # a topology, positions, results
        if flush < 10:
            _, values = _recording(node, messages=20, flushed=20, synced=20)
        node.stop(signal.SIGKILL)
    finally:
        node.close()
    assert examine(path).message_count == (20 if flush < 10 else 0)
    assert int(values["write_errors"]) == int(values["not_synced"]) == 0


def test_own_recording_holds_what_was_sent(start_node, tmp_path):
    node = start_node({"meshes": ["cloth"], "record": str(tmp_path / "run"), "record_split_time": 0.5})
    node.peer.topology("cloth", FACES, N * N)
    stream(node, range(60))
    assert node.stop(signal.SIGTERM) == 0
    steps = _replayed(tmp_path / "run")
    assert len(steps) == 59
    for k, step in enumerate(steps):
        assert np.array_equal(step.start_frame.vertices[0], sheet_positions(N, k))
