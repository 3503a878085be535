# SPDX-License-Identifier: Apache-2.0
"""`hpccd cut`: any part of a recording replays by itself, and is verified."""

import dataclasses
import functools
import json
import random
import re
import shlex

import crane
import numpy as np
import pytest
from bag_tools import raw_messages
from geometry_msgs.msg import PoseStamped
from hpccd.msg import ContactArray
from in_process import hpccd
from mcap.reader import make_reader
from mcap_model import Bag
from mesh_in_a_hand import transform
from rclpy.serialization import serialize_message
from rosbags.highlevel import AnyReader
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from waving_sheet import sheet_faces, sheet_positions

from hpccd_core.rigid.transform import Rigid
from hpccd_ros.bag.cut import Time, cut, seconds
from hpccd_ros.bag.reader import Recording, RecordingError
from hpccd_ros.bag.writer import BagWriter, Topic
from hpccd_ros.middleware import contact_messages, fields, mesh_messages, result_fields
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay

N = 6
SECOND = 10**9
BEGAN = 10**18
LATE = SECOND // 4  # from the last input of a step to its result: some are under way at each cut
FRAMES = 40  # ten a second
PARAMETERS = {
    "meshes": ["cloth", "tool", "table"],
    "robots": ["crane"],
    "frame_id": "world",
    "mesh.tool.input": "pose",
    "mesh.table.static": True,
    "robot.crane.description": "robot_description",
    "robot.crane.joint_states": "joint_states",
}
TYPES = {
    "robot_description": "std_msgs/msg/String",
    "joint_states": "sensor_msgs/msg/JointState",
    "transforms": "geometry_msgs/msg/TransformStamped",
    "transforms_static": "geometry_msgs/msg/TransformStamped",
    **{f"meshes/{mesh}/topology": "hpccd/msg/MeshTopology" for mesh in ("cloth", "tool", "table")},
    **{f"meshes/{mesh}/vertices": "hpccd/msg/MeshVertices" for mesh in ("cloth", "tool", "table")},
    "meshes/tool/pose": "geometry_msgs/msg/PoseStamped",
    "contacts": "hpccd/msg/ContactArray",
}
OTHER_CRANE = crane.URDF.replace('radius="0.06"', 'radius="0.08"')


def _inputs(end=FRAMES):
    """(topic, message, s when it came). Things that are sent once, and streams of unlike rates."""
    yield "robot_description", String(data=crane.URDF), 0.0
    yield "transforms_static", transform("world", "floor", Rigid.of((0.1, 0.2, 0.0), (0, 0, 0, 1))), 0.001
    for k, mesh in enumerate(("cloth", "tool", "table")):
        yield f"meshes/{mesh}/topology", mesh_messages.topology_message(sheet_faces(N), N * N), 0.002 + 0.001 * k
    for k, mesh in enumerate(("tool", "table")):
        sheet = sheet_positions(N, k, offset=0.05 * k, dtype=np.float64)
        yield f"meshes/{mesh}/vertices", mesh_messages.vertices_message(sheet, 0, frame_id="world"), 0.006 + 0.001 * k

    def times(every, first=0.02):
        return np.arange(first, end / 10, every)

    for k in range(end):
        at, stamp = 0.1 + k / 10, round((0.1 + k / 10) * SECOND)
        yield (
            "meshes/cloth/vertices",
            mesh_messages.vertices_message(sheet_positions(N, k), stamp, step=k, frame_id="world"),
            at + 0.01,
        )
        pose = PoseStamped()
        pose.header.stamp, pose.header.frame_id = fields.ns_to_stamp(stamp), "world"
        pose.pose.position.z, pose.pose.orientation.w = 0.02 * np.sin(k), 1.0
        yield "meshes/tool/pose", pose, at + 0.02
    for joint, every in (("turn", 0.04), ("reach", 0.33)):
        for at in times(every):
            message = JointState(name=[joint], position=[crane.values(at)[joint]])
            message.header.stamp = fields.ns_to_stamp(round(at * SECOND))
            yield "joint_states", message, at + 0.005
    for at in times(0.23):
        yield (
            "transforms",
            transform("floor", crane.ROOT, Rigid.of((0.1 * at, 0.3, 0.03), (0, 0, 0, 1)), round(at * SECOND)),
            at + 0.015,
        )


def _write(path, messages, split=0.0):
    """messages: (topic, CDR, ns when it came)."""
    info = {
        "format": 1,
        "hpccd": "0",
        "node": "/hpccd",
        "parameters": PARAMETERS,
        "topics": {f"/{topic}": topic for topic in TYPES},
    }
    bag = BagWriter(path, info=info, attachments=[("mesh/x/y.obj", b"any")], max_seconds=split)
    for topic, type_name in TYPES.items():
        once = topic.endswith(("topology", "_static", "description"))
        bag.add_topic(Topic(f"/{topic}", type_name, [], latched=100 * once))
    for number, (topic, data, came) in enumerate(sorted(messages, key=lambda row: row[2])):
        bag.write(f"/{topic}", data, came, came - 1000, number + 1)
    bag.close()


def _raw(inputs):
    return [(topic, serialize_message(message), BEGAN + round(came * SECOND)) for topic, message, came in inputs]


def _results(path):
    """Those of a node that is as late as LATE, to all that the recording `path` without results holds."""
    with Recording(path) as recording:
        first = next(recording.messages()).log_time
        replay = Replay(recording, recorded_setup.of_recording(recording), backend="cpu")
        for step in replay.steps():
            message = ContactArray(step=step.step, accuracy="exact", backend="cpu")
            message.header.stamp, message.start = fields.ns_to_stamp(step.end), fields.ns_to_stamp(step.start)
            contact_messages.fill_contacts(message, step.contacts, step.layout)
            result_fields.fill_bounds(message, step.bounds)
            yield "contacts", serialize_message(message), first + round(step.at * SECOND) + LATE


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    inputs = _raw(_inputs())
    _write(folder / "silent.mcap", inputs)
    _write(folder / "run.mcap", [*inputs, *_results(folder / "silent.mcap")])
    return folder / "run.mcap"


def _replayed(path):
    with Recording(path) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording), backend="cpu")
        steps = list(replay.steps())
    assert replay.diverged == replay.unverified == 0, [step.difference or step.missing for step in steps]
    return replay, [step.step for step in steps if not step.missing]


def _cut(source, target, begin=None, end=None, **options):
    target.unlink(missing_ok=True)
    with Recording(source) as recording:
        return cut(recording, target, begin, end, **options)


def test_parts_that_begin_and_end_anywhere_are_verified(whole, tmp_path):
    replay, steps = _replayed(whole)
    assert replay.verified == len(steps) == FRAMES - 2
    part = tmp_path / "part.mcap"
    times = [message.log_time - BEGAN for message in raw_messages(whole)]
    generator = random.Random(4)
    reached = 0
    for begin in generator.sample(times, 14):
        end = begin + generator.randrange(SECOND // 5, 4 * SECOND)
        found = _cut(whole, part, Time(begin), Time(end))
        replay, verified = _replayed(part)
        reached += len(verified)
        # Those whose step began after the cut, and whose result came before the end.
        expected = [step for step in steps if 0.1 + (step - 1) / 10 > begin / SECOND and _came(whole)[step] < end]
        assert set(expected) <= set(verified), (begin, end, expected, verified)
        received = [m for m in raw_messages(whole) if begin <= m.log_time - BEGAN < end]
        assert found.count - found.in_force == len(received) and found.begin == begin
        # The messages of the part are unchanged, and follow those in force.
        assert raw_messages(part)[found.in_force :] == received
    assert reached > 50


@functools.cache
def _came(path):
    """Step -> when its result came, ns after the beginning."""
    results = [message.log_time - BEGAN for message in raw_messages(path) if message.topic == "/contacts"]
    return dict(zip(_replayed(path)[1], results, strict=True))


def test_two_parts_that_join_hold_every_message_once(whole, tmp_path):
    before, after = tmp_path / "before.mcap", tmp_path / "after.mcap"
    at = Time.of("1.5")
    first, second = _cut(whole, before, end=at), _cut(whole, after, begin=at)
    everything = raw_messages(whole)
    assert first.in_force == 0 and first.count + second.count - second.in_force == len(everything)
    # Once sent things, the last pose and cloth, and joints and transforms of the last ten seconds.
    assert 10 < second.in_force < 100
    assert raw_messages(before) + raw_messages(after)[second.in_force :] == everything
    with Recording(whole) as one, Recording(after) as other:
        assert (one.info, one.attachments) == (other.info, other.attachments)
        assert [dataclasses.replace(t, count=0) for t in sorted(one.topics.values(), key=str)] == [
            dataclasses.replace(t, count=0) for t in sorted(other.topics.values(), key=str)
        ]
    with AnyReader([after]) as reader:
        assert [(c.topic, t, bytes(data)) for c, t, data in reader.messages()] == [
            (m.topic, m.log_time, m.data) for m in raw_messages(after)
        ]


def test_of_joints_and_frames_that_are_told_seldom_the_last_is_kept(tmp_path):
    """A part that begins later than the seconds kept whole: `reach` and the transforms are sent only once, before."""
    inputs = [row for row in _inputs(4) if not (row[0] == "joint_states" and row[1].name == ["reach"] and row[2] > 0.1)]
    late = [(topic, message, came + 60.0 * (came > 0.1)) for topic, message, came in inputs]
    _write(tmp_path / "x.mcap", _raw(late))
    part = _cut(tmp_path / "x.mcap", tmp_path / "part.mcap", Time.of("60.2"))
    kept = raw_messages(tmp_path / "part.mcap")[: part.in_force]
    with Recording(tmp_path / "x.mcap") as recording:
        names = [t for t in recording.topics if t != "/contacts"]
    assert {message.topic for message in kept} == set(names)
    assert [m.publish_time for m in kept] == sorted(m.publish_time for m in kept)
    joints = [m for m in kept if m.topic == "/joint_states"]
    assert any(b"reach" in m.data for m in joints) and any(b"turn" in m.data for m in joints)


def test_a_robot_whose_description_changed_is_replayed_in_two_parts(tmp_path, monkeypatch):
    """As the error says it."""
    monkeypatch.chdir(tmp_path)
    changed = round(2.013 * SECOND)
    inputs = [*_raw(_inputs()), ("robot_description", serialize_message(String(data=OTHER_CRANE)), BEGAN + changed)]
    _write(tmp_path / "silent.mcap", inputs)
    results = []
    for begin, end in ((None, Time(changed)), (Time(changed), None)):
        _cut(tmp_path / "silent.mcap", tmp_path / "part.mcap", begin, end)
        # A node computes with the robot that it has.
        results += [row for row in _results(tmp_path / "part.mcap") if begin is not None or row[2] < BEGAN + changed]
    _write(tmp_path / "run.mcap", [*inputs, *results])
    done = hpccd("replay", "run.mcap")
    assert done.status == 2 and "robot crane: its description on robot_description changed 2.013000000 s" in done.err
    commands = re.findall(r"`hpccd ([^`]*)`", done.err)
    assert len(commands) == 2
    verified = 0
    for command in commands:
        assert hpccd(*shlex.split(command)).status == 0
        name = command.split()[-1]
        done = hpccd("replay", name, "--json", f"{name}.json")
        assert done.status == 0 and "VERIFIED: " in done.out, done
        verified += json.loads((tmp_path / f"{name}.json").read_text())[0]["verified"]
    assert verified == len(results) > 20


def test_stamps_name_frames(whole, tmp_path):
    part = tmp_path / "part.mcap"
    found = _cut(whole, part, Time.of("1100000000ns"), Time.of("2000000000ns"))
    _, verified = _replayed(part)
    # Frame k has the stamp 0.1 + k / 10 s.
    assert verified == [*range(verified[0], 20)] and verified[0] in (10, 11), (verified, found)
    with Recording(whole) as recording, pytest.raises(RecordingError, match="no message with the stamp .* or later"):
        cut(recording, tmp_path / "x.mcap", Time.of("1700000000000000000ns"), None)
    assert not (tmp_path / "x.mcap").exists()


@pytest.mark.parametrize("text, value", [("12.5", 12_500_000_000), ("0s", 0), ("2.013000001", 2_013_000_001)])
def test_times(text, value):
    assert Time.of(text) == Time(value) and Time.of(seconds(value)) == Time(value)


@pytest.mark.parametrize("text", ["", "-1", "nan", "1e3", "5 ns", "1.5ns", "now"])
def test_what_is_no_time(text):
    with pytest.raises(ValueError, match="is not a time; give seconds"):
        Time.of(text)


def test_a_split_recording_and_channels_of_others(tmp_path, sound_bags):
    """A folder becomes one file, and messages that are not of ROS 2 are copied too."""
    _write(tmp_path / "run", _raw(_inputs(20)), split=0.5)
    found = _cut(tmp_path / "run", tmp_path / "part.mcap", Time.of("0.7"), Time.of("1.6"), compression="zstd")
    with Recording(tmp_path / "run") as recording:
        assert len(recording.files) > 2
        received = [m for m in recording.messages() if 0.7 <= (m.log_time - BEGAN) / SECOND < 1.6]
    assert found.count - found.in_force == len(received)
    bag = Bag.read(sound_bags / "streams.mcap")
    bag.channels.append(dataclasses.replace(bag.channels[0], id=90, topic="/log", message_encoding="json", schema_id=0))
    bag.messages.append(dataclasses.replace(bag.messages[-1], channel_id=90, data=b"{}"))
    bag.write(tmp_path / "x.mcap")
    _cut(tmp_path / "x.mcap", tmp_path / "y.mcap", Time.of("0.2"))
    with open(tmp_path / "y.mcap", "rb") as stream:
        foreign = [m.data for _, c, m in make_reader(stream).iter_messages() if c.topic == "/log"]
    assert foreign == [b"{}"]
    _replayed(tmp_path / "y.mcap")


def test_the_command(whole, tmp_path, hpccd):
    done = hpccd("cut", whole, "--from", "1", "--to", "2", "-o", "part.mcap", "--compression", "lz4")
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(
        rf"part\.mcap: \d+ messages, from 1\.000000000 to \d\.\d+ s of {whole}\n  \d+ of them were "
        r"received earlier and were in force at its beginning\n",
        done.stdout,
    ), done.stdout
    assert hpccd("doctor", "part.mcap").returncode == 0
    again = hpccd("cut", whole, "--from", "1", "-o", "part.mcap")
    assert again.returncode == 2 and again.stderr == "hpccd cut: -o part.mcap: already exists; give another name\n"
    lasts = seconds(raw_messages(whole)[-1].log_time - BEGAN)
    for options, words in (
        (("--from", "99"), "has no message in this part; its messages are from 0 to "),
        (("--from", "9" * 23), "has no message in this part; its messages are from 0 to "),
        (("--to", "0"), f"in this part; its messages are from 0 to {lasts} s"),
        (("--from", "3", "--to", "3"), f"in this part; its messages are from 0 to {lasts}"),
        (("--from", "3", "--to", "2"), "swap --from and --to"),
    ):
        done = hpccd("cut", whole, *options, "-o", "none.mcap")
        assert done.returncode == 2 and words in done.stderr and done.stderr.count("\n") == 1
        assert not (tmp_path / "none.mcap").exists()


def test_a_damaged_recording_is_not_cut(whole, tmp_path, hpccd):
    data = bytearray(whole.read_bytes())
    data[len(data) // 2] ^= 1
    (tmp_path / "x.mcap").write_bytes(data)
    done = hpccd("cut", "x.mcap", "--from", "0", "-o", "part.mcap")
    assert done.returncode == 2 and "x.mcap is damaged" in done.stderr and "hpccd doctor" in done.stderr
    assert not (tmp_path / "part.mcap").exists()
