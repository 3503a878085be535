# SPDX-License-Identifier: Apache-2.0
"""The topic stop of a node as a process: true when meshes come close, and when the state is unknown."""

import contextlib
import math
import signal
import time

import numpy as np
import pytest
import stop_stream
from geometry_msgs.msg import TransformStamped
from hand_and_table import FACES, MESHES, TABLE, hand
from hpccd.msg import MeshVertices
from lifecycle_msgs.msg import Transition
from node_calls import change_state, set_parameter
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from stop_stream import NEAR, SHORT, TIMEOUT

from hpccd_ros.middleware import fields, mesh_messages, qos


@pytest.fixture
def start_stream(start_node):
    with contextlib.ExitStack() as stack:

        def start(timeout=TIMEOUT, **parameters):
            return stack.enter_context(stop_stream.started(start_node, timeout, **parameters))

        yield start


def test_true_while_anything_is_near(start_stream):
    """From before the first answer on; at any time of a step, whole surfaces, as near counts as nearer."""
    stream = start_stream(features=["edge_edge"], accuracy="fast")
    stream.expect(True)
    stream.status("unanswered", "no step has a result since the node was activated")
    stream.topologies()
    stream.frame(2.0)
    stream.status("unanswered", "no step has a result since the stream, or a topology, restarted")
    stream.frame(1.0)
    stream.expect(False)
    assert stream.status("")["stop"] == "False"
    just_above = NEAR * (1 + 1e-15)
    for height, near in ((just_above, False), (NEAR, True), (1.0, True), (1.0, False), (-2.0, True)):
        stream.frame(height)
        stream.answered()
        stream.expect(near)
    stream.status("near", "true: hand and table came within 0.25 of each other in the last step")
    stream.frame(-2.0)
    stream.expect(False)
    assert stream.status("")["rises.near"] == "2"


def test_a_step_that_passes_through_is_true(start_stream):
    stream = start_stream(stop_distance=0.0)
    stream.topologies()
    for height in (5.0, 4.0):
        stream.frame(height)
    stream.expect(False)
    stream.heard.clear()
    stream.frame(-4.0)
    stream.node.wait_until(lambda: any(said for _, said in stream.heard), "stop")
    stream.frame(-4.0)
    stream.expect(False)


def test_on_coarse_faces(start_stream):
    pytest.importorskip("fast_simplification", reason="coarse faces need the extra detail")
    stream = start_stream(stop_detail=["hand:0.5", "table:0.5"])
    stream.topologies()
    for height in (2.0, 1.0):
        stream.frame(height)
    stream.expect(False)
    stream.frame(NEAR)
    stream.answered()
    stream.expect(True)


def test_only_different_meshes_that_are_tested(start_stream):
    """The hand alone folds so that parts of it are near each other all the time."""
    fan = np.array([[0, 1, 2], [3, 4, 5]], np.uint32)
    stream = start_stream(meshes=["hand", "table", "wall"], ignored_pairs=["hand:wall", "table:wall"])
    stream.node.peer.topology("hand", fan, 6)
    for name in ("table", "wall"):
        stream.node.peer.topology(name, FACES, 3)
    folded = np.concatenate([hand(2.0), hand(2.0) + (0, 0, 0.01)])
    for stamp in (1, 2):
        stream.node.peer.vertices("hand", folded, stamp=stamp)
        stream.node.peer.vertices("table", TABLE, stamp=stamp)
        stream.node.peer.vertices("wall", TABLE, stamp=stamp)
    stream.expect(False)


def test_an_edge_in_the_middle_of_a_face_stays_near(start_stream):
    """No corner or border is near another: only the first step, from the stream's begin on, can tell."""
    needle = np.array([[0, 0, -6.0], [0, 0, 6.0], [0.01, 0, 6.0]])
    stream = start_stream()
    stream.topologies()
    for _ in range(3):
        stream.frame(needle)
    stream.answered()
    stream.status("near")
    assert stream.listener.stop
    assert all(said for _, said in stream.heard)


@pytest.mark.parametrize("what", ["not finite", "count", "backward", "topology"])
def test_what_is_rejected_is_true_until_something_valid_of_the_mesh_comes(start_stream, what):
    stream = start_stream()
    stream.start()
    if what == "topology":
        stream.node.peer.topology("hand", FACES[:, ::-1], 3)
    else:
        bad = {"not finite": np.full((3, 3), math.nan), "count": np.zeros((4, 3)), "backward": hand(1.0)}[what]
        stream.node.peer.vertices("hand", bad, stamp=stream.sent + 1 if what != "backward" else 1)
    reason = {"not finite": "not_finite", "count": "wrong_vertex_count", "backward": "stamp_backward"}
    stream.status("rejected", f"of mesh hand rejected: {reason.get(what, 'topology_conflict')}")
    stream.expect(True)
    stream.sent += 1
    if what == "topology":  # which one the positions belong to, they do not say
        stream.frame(1.0)
        stream.answered(3)
        assert stream.listener.stop
        stream.topologies()
    stream.frame(1.0)
    stream.expect(False)


def test_a_static_mesh_whose_new_place_is_rejected_is_unknown(start_stream):
    """Frames of the other mesh continue, but say nothing about this one, which may have moved."""
    stream = start_stream(mesh={"table": {"static": True}}, frame_queue=10)
    peer = stream.node.peer
    stream.topologies()

    def hands():
        for _ in range(2):
            stream.sent += 1
            peer.vertices("hand", hand(2.0), stamp=stream.sent, frame_id="world")
        stream.node.frames_status(processed=stream.sent + taken)

    taken = 1
    peer.vertices("table", TABLE, stamp=1, frame_id="world")
    stream.node.frames_status(processed=taken)
    hands()
    stream.expect(False)
    moved = TABLE + [0, 0, 1.9]
    for rejected, cause in (
        (lambda: peer.vertices("table", moved * math.nan, stamp=2, frame_id="world"), "not_finite"),
        (lambda: peer.vertices("table", moved[:2], stamp=2, frame_id="world"), "wrong_vertex_count"),
        (lambda: peer.topology("table", FACES + 9, 3, version=1), "index_range"),
        (lambda: peer.vertices("table", moved, stamp=2, frame_id="map"), "is not in use yet"),
    ):
        rejected()
        if cause == "is not in use yet":
            taken += 1
            stream.node.frames_status(processed=stream.sent + taken)
            hands()
        stream.status("rejected", cause)
        stream.expect(True)
        hands()
        stream.status("rejected", cause)
        assert stream.listener.stop
        peer.topology("table", FACES, 3)
        peer.vertices("table", TABLE, stamp=2, frame_id="world")
        taken += 1
        stream.node.frames_status(processed=stream.sent + taken)
        hands()
        stream.expect(False)


def test_messages_that_cannot_be_deserialised(start_stream):
    """The first one since the node was activated, and one whose only trace is a gap before one of another frame."""
    moved = {"transform": "tf", "frame": "mount"}
    stream = start_stream(mesh={"table": {"static": True}, "hand": moved}, frame_id="world")
    peer = stream.node.peer
    static = peer.publisher(TransformStamped, "transforms_static", qos.TRANSFORMS_STATIC)

    def mount(child):
        message = TransformStamped(child_frame_id=child)
        message.header.frame_id, message.transform.rotation.w = "world", 1.0
        return message

    def until(condition, what):
        def sent():
            stream.sent += 1
            peer.vertices("hand", hand(2.0), stamp=stream.sent, frame_id="mount")
            return condition()

        stream.node.wait_until(sent, what)

    def is_false():
        return not stream.listener.stop

    def is_rejected(text):
        _, message, values = peer.statuses.get("stop", (b"", "", {}))
        return values.get("cause") == "rejected" and text in message

    static.publish(mount("mount"))
    peer.vertices("table", TABLE, stamp=1, frame_id="world")
    stream.topologies()
    until(is_false, "false")
    static.publish(serialize_message(mount("mount"))[:24])
    static.publish(mount("other"))
    # Either the message itself is noticed, or only the gap that it leaves before the next one.
    until(
        lambda: (
            is_rejected("transforms_static rejected: malformed")
            or is_rejected("the position of mesh hand was rejected")
        ),
        "doubt of the transform",
    )
    static.publish(mount("mount"))
    until(is_false, "false again")
    assert change_state(stream.node, Transition.TRANSITION_DEACTIVATE)
    assert change_state(stream.node, Transition.TRANSITION_ACTIVATE)
    static.publish(mount("mount"))
    until(is_false, "false after the node was activated again")
    table = peer.publisher(MeshVertices, "meshes/table/vertices")
    table.publish(serialize_message(mesh_messages.vertices_message(TABLE, 2))[:24])
    until(lambda: is_rejected("mesh table rejected: malformed"), "doubt of the table")
    stated = stream.sent
    until(lambda: stream.sent >= stated + 20, "frames of the hand")
    assert is_rejected("mesh table rejected: malformed") and stream.listener.stop


@pytest.mark.parametrize("lost", [False, True])
def test_a_publisher_of_static_transforms_that_ends_is_no_loss_and_hides_none(start_stream, lost):
    """The numbers of the one that stays follow those of the one that ended."""
    stream = start_stream(mesh={"hand": {"transform": "tf", "frame": "mount"}}, frame_id="world")
    peer, node = stream.node.peer, stream.node.peer.node
    stays, ends = (node.create_publisher(TransformStamped, "transforms_static", qos.TRANSFORMS_STATIC) for _ in "ab")

    def publish(publisher, child):
        message = TransformStamped(child_frame_id=child)
        message.header.frame_id, message.transform.rotation.w = "world", 1.0
        publisher.publish(message)

    def used(child):
        """Wait until a transform is in use: a frame in its coordinates is answered."""
        stream.sent += 1
        peer.vertices("hand", hand(2.0), stamp=stream.sent, frame_id=child)
        peer.vertices("table", TABLE, stamp=stream.sent, frame_id="world")
        stream.answered()

    stream.topologies()
    stream.node.wait_until(lambda: min(p.get_subscription_count() for p in (stays, ends)) == 1, "both are heard")
    for _ in range(3):
        publish(stays, "other")
    publish(stays, "mount")
    used("mount")
    publish(ends, "mount")
    used("mount")
    node.destroy_publisher(ends)
    stream.node.wait_until(lambda: node.count_publishers(stays.topic_name) == 1, "one has ended")
    if lost:
        stream.node.process.send_signal(signal.SIGSTOP)  # so that the next two messages come together
        stays.publish(serialize_message(TransformStamped(child_frame_id="mount"))[:24])
        publish(stays, "other")
        time.sleep(0.3)
        stream.node.process.send_signal(signal.SIGCONT)
    else:
        publish(stays, "mount")
    for _ in range(5):
        used("mount")
    rejected = stream.node.frames_status(processed=2 * stream.sent).get("transforms_rejected", "0")
    assert rejected == ("1" if lost else "0")
    if lost:

        def in_doubt():
            """Which of two texts depends on whether the middleware handed over both messages at once."""
            used("mount")
            _, message, values = stream.node.peer.statuses.get("stop", (b"", "", {}))
            return values.get("cause") == "rejected" and ("mesh hand" in message or "malformed" in message)

        stream.node.wait_until(in_doubt, "the transform is in doubt")
        peer.statuses.clear()
        stream.node.wait_until(in_doubt, "the doubt that newer frames leave")
        assert stream.listener.stop


SLIDER = """<robot name="arm"><link name="base"/><link name="tip"><collision><geometry><box size="0.1 0.1 0.1"/>
</geometry></collision></link><joint name="z" type="prismatic"><parent link="base"/><child link="tip"/>
<axis xyz="0 0 1"/><limit lower="-9" upper="9"/></joint></robot>"""


def test_a_robot_of_which_something_newer_is_rejected_is_unknown(start_stream):
    """A joint named twice, publishers that contradict each other, descriptions that are rejected or make no scene."""
    stream = start_stream(
        meshes=["table"],
        mesh={"table": {"static": True}},
        robots=["arm"],
        ignored_pairs=["arm:arm"],
        pair_separation=["arm/tip:table:0.1"],
        robot={"arm": {"joint_states": "joint_states", "pose": [0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0]}},
    )
    peer, stamp = stream.node.peer, 10**9
    peer.topology("table", FACES, 3)
    peer.vertices("table", TABLE, stamp=1)
    stream.node.frames_status(processed=1)
    describe = peer.publisher(String, "robot_description", qos.DESCRIPTION)
    other = peer.node.create_publisher(JointState, "joint_states", 10)

    def say(names=("z",), at=(0.0,), publisher=None):
        message = JointState(name=list(names), position=list(at))
        message.header.stamp = fields.ns_to_stamp(stamp)
        (publisher or peer.publisher(JointState, "joint_states")).publish(message)

    def until(condition, **options):
        """Joint states go on meanwhile."""
        nonlocal stamp
        deadline = time.monotonic() + 60
        while not condition():
            assert time.monotonic() < deadline, stream.node.peer.statuses["stop"]
            stamp += 10**7
            say(**options)
            stream.node.peer.executor.spin_once(timeout_sec=0.02)

    def stop_is(said, text=""):
        def heard():
            status = peer.statuses.get("stop", (b"", "", {}))
            return stream.heard and stream.heard[-1][1] is said and text in status[1]

        return heard

    def clear():
        until(stop_is(False))

    describe.publish(String(data=SLIDER))
    clear()
    until(stop_is(True, "true: table and arm/tip came within 0.25 of each other"), at=(-1.95,))
    clear()
    until(stop_is(True, "joint states on joint_states rejected: malformed"), names="zz", at=(-1.95, 0.0))
    clear()
    for _ in range(20):
        stamp += 10**7
        say()
        say(at=(-1.0,), publisher=other)
        peer.executor.spin_once(timeout_sec=0.02)
    stream.status("rejected", "two publishers on joint_states contradict each other")
    until(stop_is(True, "contradict each other"))
    peer.node.destroy_publisher(other)
    stamp += 11 * 10**9
    clear()
    for wrong, why in (
        (SLIDER.replace('name="base"/>', 'name="base"/><link name="stray"/>'), "its description was rejected"),
        (SLIDER.replace('"tip"', '"tool"'), "the scene stays as it was"),
    ):
        describe.publish(String(data=wrong))
        until(stop_is(True, why))
        for _ in range(20):
            stamp += 10**7
            say()
            peer.executor.spin_once(timeout_sec=0.02)
        assert stop_is(True, why)()
        describe.publish(String(data=SLIDER))
        clear()


def test_a_new_topology_is_true_until_a_step_with_it(start_stream):
    stream = start_stream()
    stream.start()
    stream.topologies(version=1)
    stream.frame(1.0, topology_version=1)
    stream.expect(True)
    stream.status("unanswered")
    stream.frame(1.0, topology_version=1)
    stream.expect(False)


def test_dead_input_is_true(start_stream):
    stream = start_stream(SHORT, frame_queue=1)
    stream.topologies()
    with stream.steady():
        stream.expect(False)
    died = time.monotonic()
    stream.expect(True)
    rose = next(at for at, said in reversed(stream.heard) if at > died and said)
    assert rose - died < SHORT + 5.0
    stream.status("silent", "the last result is based on a message sent")


def test_frames_that_waited_while_the_node_was_held_up_are_old(start_stream):
    """The publisher has died in the meantime: its earlier messages are not new."""
    stream = start_stream(SHORT, frame_queue=1)
    stream.topologies()
    with stream.steady():
        stream.expect(False)
        stream.node.process.send_signal(signal.SIGSTOP)
        time.sleep(0.3)
    time.sleep(2 * SHORT)
    before = len(stream.heard)
    stream.node.process.send_signal(signal.SIGCONT)
    stream.node.wait_until(lambda: len(stream.heard) > before + 6, "repetitions")
    assert all(said for _, said in stream.heard[before:])
    with stream.steady():
        stream.expect(False)


def test_the_distance_may_change_and_not_be_switched_off(start_stream):
    stream = start_stream()
    stream.start()
    for value, reason in ((-1.0, "switch the topic stop on or off"), (-0.5, "use -1, or at least 0")):
        answer = set_parameter(stream.node, "stop_distance", value)
        assert not answer.successful and reason in answer.reason
    assert set_parameter(stream.node, "stop_distance", 1.5).successful
    stream.expect(True)
    stream.status("unanswered", "since stop_distance became 1.5")
    stream.frame(1.0)
    stream.status("near", "within 1.5")
    assert set_parameter(stream.node, "stop_distance", 0.5).successful
    stream.frame(1.0)
    stream.expect(False)
    assert stream.status("")["stop_distance"] == "0.5"


def test_the_life_cycle_makes_it_true(start_stream):
    stream = start_stream()
    stream.start()
    assert change_state(stream.node, Transition.TRANSITION_DEACTIVATE)
    stream.expect(True)
    stream.status("inactive")
    assert change_state(stream.node, Transition.TRANSITION_ACTIVATE)
    stream.status("unanswered")
    for _ in range(2):
        stream.frame(1.0)
    stream.expect(False)
    assert change_state(stream.node, Transition.TRANSITION_DEACTIVATE)
    assert change_state(stream.node, Transition.TRANSITION_CLEANUP)
    stream.expect(True)
    stream.node.wait_until(lambda: "0 publishers alive, 1 expected" in stream.listener.reason, "no publisher")


def test_faults_are_warnings_in_the_log_and_other_changes_are_not(start_stream):
    stream = start_stream(timeout=SHORT)

    def logged(level, text):
        def is_logged():
            return any(f"[{level}]" in line and text in line for line in stream.node.output().splitlines())

        stream.node.wait_until(is_logged, text)

    with stream.steady():
        stream.topologies()
        logged("INFO", "stop is false")
    logged("WARN", "the last result is based on a message sent")
    with stream.steady(height=0.1):
        logged("INFO", "stop: hand and table came within 0.25")
    assert "stop: the node is not active" not in stream.node.output(), "each node begins so"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_its_last_word_is_true(start_stream, number):
    stream = start_stream()
    stream.start()
    assert stream.node.stop(number) == 0
    deadline = time.monotonic() + 60
    while not stream.heard[-1][1] and time.monotonic() < deadline:
        time.sleep(0.01)
    assert stream.heard[-1][1] and stream.listener.stop


def test_nothing_to_watch_is_rejected(start_node):
    for given in ({"meshes": ["hand"]}, {"meshes": list(MESHES), "ignored_pairs": ["table:hand"]}, {"meshes": [""]}):
        node = start_node({**given, "stop_distance": 0.1}, wait=False)
        assert node.process.wait(60) == 2 and "stop_distance: no two different meshes" in node.output()


def test_off_unless_asked_for(start_node):
    node = start_node({"meshes": list(MESHES)})
    node.frames_status(received=0)
    assert node.peer.node.count_publishers("stop") == 0 and "stop" not in node.peer.statuses
