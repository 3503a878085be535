# SPDX-License-Identifier: Apache-2.0
"""The topic stop of a node as a process: true where meshes come near, and wherever that is not known to be otherwise."""

import math
import signal
import threading
import time

import hand_and_table
import numpy as np
import pytest
from hand_and_table import FACES, MESHES, TABLE, hand
from lifecycle_msgs.msg import Transition
from node_calls import change_state, set_parameter
from rclpy.executors import SingleThreadedExecutor
from std_msgs.msg import Bool

from hpccd_ros import client

NEAR = 0.25
TIMEOUT = 5.0  # s: above what a busy machine makes of a frame
SHORT = 0.5


class Stream:
    """Frames of the hand above the table, and all that was said on stop, heard in a thread of its own."""

    def __init__(self, node, timeout=TIMEOUT):
        self.node, self.sent = node, 0
        self.heard: list[tuple[float, bool]] = []
        self._node = _node_beside(node)
        self._node.create_subscription(
            Bool, client.STOP_TOPIC, lambda m: self.heard.append((time.monotonic(), m.data)), client.stop_qos(timeout)
        )
        self.listener = client.StopListener(self._node, stop_timeout=timeout)
        self._executor = SingleThreadedExecutor(context=node.peer.context)
        self._executor.add_node(self._node)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._spin)
        self._thread.start()

    def _spin(self):
        while not self._ended.is_set():
            self._executor.spin_once(timeout_sec=0.05)

    def close(self):
        self._ended.set()
        self._thread.join()
        self._executor.shutdown()
        self._node.destroy_node()

    def topologies(self, **options):
        for name in MESHES:
            self.node.peer.topology(name, FACES, 3, **options)

    def frame(self, height, **fields):
        """Send it. height: of the hand, or its positions."""
        hands = hand(height) if np.ndim(height) == 0 else height
        self.sent += 1  # its stamp, ns
        for name, positions in zip(MESHES, (hands, TABLE), strict=True):
            self.node.peer.vertices(name, positions, stamp=self.sent, **fields)

    def answered(self, count=None):
        self.node.frames_status(answered=2 * (count or self.sent))

    def expect(self, stop):
        """Wait until it is said."""
        self.node.wait_until(lambda: self.heard and self.heard[-1][1] == stop, f"stop {stop}")

    def status(self, cause, text=""):
        """Wait until the diagnostics tell this cause; their values."""

        def told():
            level, message, values = self.node.peer.statuses.get("stop", (b"", "", {}))
            return values if values.get("cause") == cause and text in message else None

        return self.node.wait_until(told, f"cause {cause!r} with {text!r}")


def _node_beside(node):
    from rclpy.node import Node

    return Node("watcher", namespace=node.namespace, context=node.peer.context)


@pytest.fixture
def start_stream(start_node):
    streams = []

    def start(timeout=TIMEOUT, **parameters):
        given = {"meshes": list(MESHES), "stop_distance": NEAR, "stop_timeout": timeout, **parameters}
        streams.append(Stream(start_node(given), timeout))
        return streams[-1]

    yield start
    for stream in streams:
        stream.close()


def test_true_while_anything_is_near(start_stream):
    """From before the first answer on; at any time of a step, whole surfaces, as near counts as nearer."""
    stream = start_stream(features=["edge_edge"], accuracy="fast")
    stream.expect(True)
    stream.status("unanswered", "no step was answered since the node was activated")
    stream.topologies()
    stream.frame(2.0)
    stream.status("unanswered", "no step was answered since the stream, or a topology, began anew")
    stream.frame(1.0)
    stream.expect(False)
    assert stream.status("")["stop"] == "False"
    just_above = NEAR * (1 + 1e-15)
    for height, near in ((just_above, False), (NEAR, True), (1.0, True), (1.0, False), (-2.0, True)):
        stream.frame(height)
        stream.answered()
        stream.expect(near)
    stream.status("near", "came within 0.25")
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
def test_what_is_refused_is_true_until_the_next_answer(start_stream, what):
    stream = start_stream()
    stream.topologies()
    for height in (2.0, 1.0):
        stream.frame(height)
    stream.expect(False)
    if what == "topology":
        stream.node.peer.topology("hand", FACES[:, ::-1], 3)
    else:
        bad = {"not finite": np.full((3, 3), math.nan), "count": np.zeros((4, 3)), "backward": hand(1.0)}[what]
        stream.node.peer.vertices("hand", bad, stamp=stream.sent + 1 if what != "backward" else 1)
    reason = {"not finite": "not_finite", "count": "wrong_vertex_count", "backward": "stamp_backward"}
    stream.status("refused", f"of mesh hand were refused: {reason.get(what, 'topology_conflict')}")
    stream.expect(True)
    stream.sent += 1
    stream.frame(1.0)
    stream.expect(False)


def test_a_new_topology_is_true_until_a_step_with_it(start_stream):
    stream = start_stream()
    stream.topologies()
    for height in (2.0, 1.0):
        stream.frame(height)
    stream.expect(False)
    stream.topologies(version=1)
    stream.frame(1.0, topology_version=1)
    stream.expect(True)
    stream.status("unanswered")
    stream.frame(1.0, topology_version=1)
    stream.expect(False)


def test_dead_input_is_true(start_stream):
    stream = start_stream(SHORT)
    stream.topologies()
    stop = threading.Event()

    def send():
        while not stop.wait(0.05):
            stream.frame(2.0)

    sender = threading.Thread(target=send)
    sender.start()
    stream.expect(False)
    stop.set()
    sender.join()
    died = time.monotonic()
    stream.expect(True)
    rose = next(at for at, said in reversed(stream.heard) if at > died and said)
    assert rose - died < SHORT + 5.0
    stream.status("silent", "the last frame that was found clear came")


def test_the_distance_may_change_and_not_be_switched_off(start_stream):
    stream = start_stream()
    stream.topologies()
    for height in (2.0, 1.0):
        stream.frame(height)
    stream.expect(False)
    for value in (-1.0, -0.5):
        answer = set_parameter(stream.node, "stop_distance", value)
        assert not answer.successful and "switch the topic stop on or off" in answer.reason
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
    stream.topologies()
    for height in (2.0, 1.0):
        stream.frame(height)
    stream.expect(False)
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
    stream.node.wait_until(lambda: stream.listener.reason.startswith("0 of 1 publishers"), "no publisher")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_its_last_word_is_true(start_stream, number):
    stream = start_stream()
    stream.topologies()
    for height in (2.0, 1.0):
        stream.frame(height)
    stream.expect(False)
    assert stream.node.stop(number) == 0
    deadline = time.monotonic() + 60
    while not stream.heard[-1][1] and time.monotonic() < deadline:
        time.sleep(0.01)
    assert stream.heard[-1][1] and stream.listener.stop


def test_nothing_to_watch_is_refused(start_node):
    for given in ({"meshes": ["hand"]}, {"meshes": list(MESHES), "ignored_pairs": ["table:hand"]}, {"meshes": [""]}):
        node = start_node({**given, "stop_distance": 0.1}, wait=False)
        assert node.process.wait(60) == 2 and "stop_distance: no two different meshes" in node.output()


def test_off_unless_asked_for(start_node):
    node = start_node({"meshes": list(hand_and_table.MESHES)})
    node.frames_status(received=0)
    assert node.peer.node.count_publishers("stop") == 0 and "stop" not in node.peer.statuses
