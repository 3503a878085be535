# SPDX-License-Identifier: Apache-2.0
"""StopListener beside publishers of stop, over DDS: whatever is missing reads as true."""

import itertools
import math
import os
import threading
import time

import pytest
import rclpy
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Bool, Float64

from hpccd_ros import client
from hpccd_ros.base.clocks import Clocks
from hpccd_ros.middleware import environment, qos

TIMEOUT = 1.0
PATIENCE = 60.0
_numbers = itertools.count()


class Speaker:
    """Publishes on stop in a context of its own, every tenth of the time-out, until it is silent or closed."""

    def __init__(self, namespace, profile=None):
        self.says, self.scale = False, 1.0
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = Node("speaker", namespace=namespace, context=self.context)
        profile = profile or qos.stop(TIMEOUT)
        self._publisher = self.node.create_publisher(Bool, "stop", profile)
        self._scale_publisher = self.node.create_publisher(Float64, "speed_scale", profile)
        self._ended = threading.Event()
        self._silent = False
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self):
        while not self._ended.wait(TIMEOUT / 10):
            if not self._silent:
                self._publisher.publish(Bool(data=self.says))
                self._scale_publisher.publish(Float64(data=self.scale))

    def silent(self, silent=True):
        self._silent = silent

    def close(self):
        if not self._ended.is_set():
            self._ended.set()
            self._thread.join()
            self.node.destroy_node()
            rclpy.shutdown(context=self.context)


class Place:
    """A namespace with speakers, and a node with listeners that is spun here and now."""

    def __init__(self, executor=SingleThreadedExecutor):
        environment.prepare()
        self.namespace = f"/l{os.getpid()}_{next(_numbers)}"
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = Node("listener", namespace=self.namespace, context=self.context)
        self.executor = executor(context=self.context)
        self.executor.add_node(self.node)
        self.speakers = []

    def speaker(self, **options):
        self.speakers.append(Speaker(self.namespace, **options))
        return self.speakers[-1]

    def listener(self, **options):
        return client.StopListener(self.node, stop_timeout=TIMEOUT, **options)

    def until(self, condition, what):
        deadline = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < deadline, f"no {what}"
            self.executor.spin_once(timeout_sec=0.02)

    def spin(self, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.02)

    def close(self):
        for speaker in self.speakers:
            speaker.close()
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture(params=[SingleThreadedExecutor], ids=["single"])
def place(request):
    made = Place(request.param)
    yield made
    made.close()


@pytest.mark.parametrize("place", [SingleThreadedExecutor, MultiThreadedExecutor], ids=["one", "many"], indirect=True)
def test_true_unless_somebody_says_false(place):
    changes = []
    listener = place.listener(on_change=lambda of: changes.append(of.stop))
    assert listener.stop and listener.reason == f"{place.namespace}/stop: no message yet"
    place.spin(0.1)
    assert listener.stop
    speaker = place.speaker()
    place.until(lambda: not listener.stop, "false")
    assert listener.reason == ""
    speaker.says = True
    place.until(lambda: listener.stop and listener.reason.endswith("/stop is true"), "true")
    speaker.says = False
    place.until(lambda: not listener.stop, "false")
    assert changes == [False, True, False]
    listener.close()
    assert listener.stop and listener.reason == f"{place.namespace}/stop: the listener was closed"


def test_a_publisher_in_another_namespace_is_named(place):
    listener = place.listener()
    elsewhere = Speaker(f"{place.namespace}/cell1")
    place.speakers.append(elsewhere)
    here, there = f"{place.namespace}/stop", f"{place.namespace}/cell1/stop"
    hint = f"{here}: no message yet; it has no publisher, and {there} has: if that is meant, give topic='{there}'"
    place.until(lambda: listener.reason == hint, "the topic that has a publisher")
    assert listener.stop
    place.speaker()
    place.until(lambda: not listener.stop, "false")


def test_silence_is_true(place):
    """Of a publisher whose process lives and whose thread does not: its DDS still sends signs of life."""
    listener, speaker = place.listener(), place.speaker()
    place.until(lambda: not listener.stop, "false")
    speaker.silent()
    place.until(lambda: listener.stop, "true")
    silence = ("/stop: no message", "/stop: the last message taken", "/stop: 0 publishers alive, 1 expected")
    place.until(lambda: any(words in listener.reason for words in silence), "why")
    speaker.silent(False)
    place.until(lambda: not listener.stop, "false")


def test_a_publisher_that_goes_away_is_true(place):
    listener, speaker = place.listener(), place.speaker()
    place.until(lambda: not listener.stop, "false")
    speaker.close()
    place.until(lambda: "/stop: 0 publishers alive, 1 expected" in listener.reason, "end of the publisher")
    assert listener.stop
    place.speaker()
    place.until(lambda: not listener.stop, "another one")


def test_another_reason_alone_is_no_change(place):
    changes = []
    listener, speaker = place.listener(on_change=lambda of: changes.append(of.stop)), place.speaker()
    place.until(lambda: not listener.stop, "false")
    speaker.says = True
    place.until(lambda: listener.reason.endswith("/stop is true"), "true")
    speaker.close()
    place.until(lambda: "/stop: 0 publishers alive, 1 expected" in listener.reason, "end of the publisher")
    assert changes == [False, True]


def test_an_executor_that_stands_still(place):
    """What is read is true, and stays true when old messages are taken at last."""
    listener, speaker = place.listener(), place.speaker()
    place.until(lambda: not listener.stop, "false")
    time.sleep(1.5 * TIMEOUT)
    assert listener.stop, "though it was said all the time"
    assert "/stop: the last message taken was sent" in listener.reason
    speaker.close()
    time.sleep(1.5 * TIMEOUT)
    seen = []
    end = time.monotonic() + TIMEOUT
    while time.monotonic() < end:
        place.executor.spin_once(timeout_sec=0.01)
        seen.append(listener.stop)
    assert len(seen) > 5 and all(seen)


@pytest.mark.parametrize("hours", [-1, pytest.param(1, marks=pytest.mark.long)])
def test_system_time_that_jumps(place, monkeypatch, hours):
    """True until both clocks have agreed again for a time-out."""
    listener = place.listener()
    place.speaker()
    place.until(lambda: not listener.stop, "false")
    now = time.time_ns
    monkeypatch.setattr(time, "time_ns", lambda: now() + hours * 3600 * 10**9)
    place.until(lambda: "system clock jumped by" in listener.reason, "doubt")
    monkeypatch.setattr(time, "time_ns", now)
    place.until(lambda: not listener.stop, "false")


def test_an_old_word_is_old_however_late_it_is_heard(place, monkeypatch):
    """A listener that starts late and receives the latched message, and a process that was suspended: the time at which
    a message was sent counts."""
    speaker = place.speaker()
    first = place.listener()
    place.until(lambda: not first.stop, "false")
    speaker.silent()
    time.sleep(1.2 * TIMEOUT)
    late = place.listener()
    end = time.monotonic() + 0.5 * TIMEOUT
    while time.monotonic() < end:
        place.executor.spin_once(timeout_sec=0.01)
        assert late.stop and first.stop
    place.until(lambda: "no message was sent since the listener was created" in late.reason, "the latched word")
    late._begun = 0
    now = time.time_ns()
    for sent, stop in ((0.9, False), (0.96, True), (-0.01, False)):
        info = {"source_timestamp": now - round(sent * TIMEOUT * 1e9), "received_timestamp": now}
        monkeypatch.setattr(late, "_clocks", Clocks(time.monotonic, lambda: now))
        late._sent, late._alive = None, 1
        late._on_message(Bool(data=False), info)
        assert late.stop is stop, late.reason
    late._on_message(Bool(data=False), {"source_timestamp": now + 50_000_000, "received_timestamp": now})
    assert "0.05 s in the future" in late.reason


def test_several_publishers(place):
    """Any that says true counts, and all must be there."""
    one, both = place.listener(), place.listener(publishers=2)
    first = place.speaker()
    place.until(lambda: not one.stop, "false of the first")
    assert both.stop
    place.until(lambda: "/stop: 1 publisher alive, 2 expected" in both.reason, "1 of 2")
    second = place.speaker()
    place.until(lambda: not both.stop, "false of both")
    second.says = True
    place.until(lambda: one.stop and both.stop, "true")
    reasons = set()
    for _ in range(30):
        place.spin(0.02)
        assert one.stop and both.stop, "the first, which says false, does not matter"
        reasons.add(one.reason.partition("/stop")[2])
    says = " is true; it has 2 publishers, of which 1 were expected (publishers=)"
    assert reasons <= {says, ": one of several publishers said true in the last 1 s"}
    second.says = False
    place.until(lambda: not one.stop and not both.stop, "false of both again")
    second.close()
    place.until(lambda: both.stop, "true as one is gone")
    place.until(lambda: not one.stop, "false of the one that is left")
    assert both.stop and not first.says


@pytest.mark.parametrize("profile", [qos.keep_last(10, latched=True), qos.stop(2 * TIMEOUT)], ids=["plain", "slower"])
def test_a_publisher_that_promises_less_is_never_heard(place, profile):
    listener = place.listener()
    place.speaker(profile=profile)
    why = "a publisher offers less than the listener requests: its stop_timeout is above 1 s"
    place.until(lambda: why in listener.reason, "why")
    place.spin(0.5)
    assert listener.stop


@pytest.mark.parametrize(
    "options, error, text",
    [
        (dict(stop_timeout=0.0), ValueError, "stop_timeout: 0.0 s; give more than 0 s"),
        (dict(stop_timeout=float("nan")), ValueError, "stop_timeout: nan s"),
        (dict(stop_timeout="1"), TypeError, "stop_timeout: expected seconds, got str"),
        (dict(topic=0.5), TypeError, r"topic: expected a name, got float; did you mean stop_timeout=0.5\?"),
        (dict(publishers=0), ValueError, "publishers: 0; at least one"),
        (dict(publishers=1.5), TypeError, "publishers: expected how many, got float"),
        (dict(publishers=True), TypeError, "publishers: expected how many, got bool"),
        (dict(clock_error="1"), TypeError, "clock_error: expected seconds, got str"),
        (dict(clock_error=-0.1), ValueError, "clock_error: -0.1 s; give from 0 s to 10 s"),
    ],
)
def test_wrong_arguments(place, options, error, text):
    with pytest.raises(error, match=text):
        client.StopListener(place.node, **options)


@pytest.mark.parametrize("times, reported", [(3.0, False), (1000.0, True)])
def test_a_much_longer_timeout_than_the_nodes_is_reported(place, capfd, times, reported):
    """Milliseconds in place of seconds."""
    listener = client.StopListener(place.node, stop_timeout=times * TIMEOUT)
    place.speaker()
    place.until(lambda: not listener.stop, "false")
    place.spin(0.2)
    says = f"/stop: stop_timeout is {times * TIMEOUT:g} s here and {TIMEOUT:g} s in the node, so a node that hangs is "
    assert (says in capfd.readouterr().err) == reported


def test_more_publishers_than_expected_are_in_the_reason(place):
    listener = place.listener()
    place.speaker()
    place.speaker().says = True
    place.until(lambda: listener.reason.endswith("; it has 2 publishers, of which 1 were expected (publishers=)"), "it")


def test_a_callback_that_cannot_be_called(place):
    with pytest.raises(TypeError, match="on_change: expected a callable, got str"):
        place.listener(on_change="print")


def test_speed_scale(place):
    """0 before the first message, in silence, and for what is no number from 0 to 1."""
    changes = []
    listener = client.SpeedScaleListener(
        place.node, stop_timeout=TIMEOUT, on_change=lambda of: changes.append(of.speed_scale)
    )
    assert listener.speed_scale == 0 and listener.reason == f"{place.namespace}/speed_scale: no message yet"
    speaker = place.speaker()
    for scale, heard in ((1.0, 1.0), (0.25, 0.25), (0.0, 0.0), (7.0, 1.0), (math.nan, 0.0), (0.5, 0.5), (-1.0, 0.0)):
        speaker.scale = scale
        place.until(lambda heard=heard: listener.speed_scale == heard, str(scale))
        assert listener.stop == (heard == 0)
        assert listener.reason == ("" if heard else f"{place.namespace}/speed_scale is 0")
    assert changes == [1, 0.25, 0, 1, 0, 0.5, 0]
    speaker.scale = 1.0
    place.until(lambda: listener.speed_scale == 1, "1")
    speaker.silent()
    place.until(lambda: listener.speed_scale == 0, "silence")
    speaker.silent(False)
    place.until(lambda: listener.speed_scale == 1, "1")
    other = place.speaker()
    place.until(lambda: "2 publishers alive" in listener.reason, "two publishers")
    assert listener.speed_scale == 0
    other.close()
    place.until(lambda: listener.speed_scale == 1, "1")
    listener.close()
    assert listener.speed_scale == 0


def test_speed_scale_when_the_executor_stands_still(place):
    listener = client.SpeedScaleListener(place.node, stop_timeout=TIMEOUT)
    place.speaker()
    place.until(lambda: listener.speed_scale == 1, "1")
    time.sleep(1.5 * TIMEOUT)
    assert listener.speed_scale == 0 and "the last message taken was sent" in listener.reason


def test_speed_scale_in_another_namespace_is_named(place):
    listener = client.SpeedScaleListener(place.node, stop_timeout=TIMEOUT)
    place.speakers.append(Speaker(f"{place.namespace}/cell1"))
    there = f"{place.namespace}/cell1/speed_scale"
    place.until(lambda: listener.reason.endswith(f"give topic='{there}'"), "the topic that has a publisher")


@pytest.mark.parametrize("hours", [-1, 1])
def test_a_jump_of_the_system_time_and_back(place, hours):
    """On simulated clocks, ``stop`` is true at once, and false again after both clocks have agreed for the time-out and
    the ten seconds that a clock set back needs."""
    listener, steady, jumped = place.listener(), 100.0, 0
    now = time.time_ns()
    listener._clocks = Clocks(lambda: steady, lambda: now + jumped)
    listener._begun, listener._alive = now + jumped, 1

    def seconds_until(condition):
        """Simulated seconds until the condition holds. A machine with a correct clock sends ten messages a time-out."""
        nonlocal steady, now
        for k in range(200):
            listener._on_message(Bool(data=False), {"source_timestamp": now, "received_timestamp": now})
            if condition():
                return k * TIMEOUT / 10
            steady, now = steady + TIMEOUT / 10, now + round(TIMEOUT * 1e8)
        raise AssertionError(listener.reason)

    assert seconds_until(lambda: not listener.stop) == 0
    jumped = hours * 3600 * 10**9
    assert f"the system clock jumped by {3600 * hours:+.3g} s" in listener.reason
    seconds_until(lambda: True)
    jumped = 0
    waited = seconds_until(lambda: not listener.stop)
    assert TIMEOUT <= waited <= TIMEOUT + 10.2
