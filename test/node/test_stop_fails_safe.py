# SPDX-License-Identifier: Apache-2.0
"""Stop is true where something dies, hangs or stands still: publisher, node, detection, executor, clock."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import holding_node
import pytest
import stop_stream
from hand_and_table import hand
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from sources import SOURCES
from stop_stream import SHORT, TIMEOUT

from hpccd_ros.middleware import fields

SUPPORT = Path(holding_node.__file__).parent
HOLDING = (str(SUPPORT / "holding_node.py"),)
# s above the time-out that a busy machine may need; what is tested is that it happens at all.
MARGIN = 15.0


@pytest.fixture
def start_stream(start_node):
    with contextlib.ExitStack() as stack:

        def start(timeout=SHORT, **options):
            return stack.enter_context(stop_stream.started(start_node, timeout, **options))

        yield start


@pytest.fixture
def source():
    """Starts a mesh source in a namespace."""
    started = []

    def start(namespace):
        command = [sys.executable, str(SUPPORT / "hand_publisher.py"), namespace]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join([SOURCES, str(SUPPORT)])}
        started.append(subprocess.Popen(command, env=environment))
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.wait()


def within(seconds, condition, what):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, f"no {what} within {seconds} s"
        time.sleep(0.005)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_the_publisher_dies(start_stream, source, number):
    stream = start_stream()
    process = source(stream.node.namespace)
    stream.expect(False)
    stream.heard.clear()
    process.send_signal(number)
    within(SHORT + MARGIN, lambda: stream.listener.stop, "stop")
    stream.status("silent", "the last result is based on")
    assert True in [said for _, said in stream.heard], "the node says it: it lives"
    if number == signal.SIGSTOP:
        process.send_signal(signal.SIGCONT)
    else:
        source(stream.node.namespace)
    stream.expect(False)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_the_node_dies(start_stream, source, number):
    stream = start_stream()
    source(stream.node.namespace)
    stream.expect(False)
    within(MARGIN, lambda: not stream.listener.stop, "false")
    stream.node.process.send_signal(number)
    within(SHORT + MARGIN, lambda: stream.listener.stop, "stop")
    reasons = ("/stop: no message", "/stop: the last message taken was sent", "/stop: 0 publishers alive, 1 expected")
    assert any(words in stream.listener.reason for words in reasons)
    if number == signal.SIGSTOP:
        stream.node.process.send_signal(signal.SIGCONT)
        within(MARGIN, lambda: not stream.listener.stop, "false")


def test_a_detection_that_raises(start_stream):
    stream = start_stream(timeout=TIMEOUT, program=HOLDING)
    stream.start()
    stream.sent = holding_node.RAISES - 1
    stream.frame(2.0)
    stream.expect(True)
    stream.status("failed", "the detection of the last step failed")
    stream.frame(2.0)
    stream.expect(False)


@contextlib.contextmanager
def found_clear(stream):
    """Frames go on coming inside, and the first of them were found clear."""
    stream.topologies()
    with stream.steady():
        stream.expect(False)
        yield


def test_a_detection_that_hangs(start_stream):
    stream = start_stream(program=HOLDING, frame_queue=1)
    with found_clear(stream):
        pass
    stream.sent = holding_node.HANGS - 1
    with stream.steady():
        stream.status("silent", "a later frame is being processed")
        stream.expect(True)
        stream.expect(False)


def test_an_executor_that_hangs(start_stream):
    """Frames are sent, and nobody in the node takes them; its stop is said all the same."""
    stream = start_stream(program=HOLDING)
    with found_clear(stream):
        request = SetParameters.Request(parameters=[Parameter("markers_max", value=7).to_parameter_msg()])
        service = stream.node.peer.node.create_client(SetParameters, "hpccd/set_parameters")
        stream.node.wait_until(service.service_is_ready, "service")
        stream.heard.clear()
        hung = service.call_async(request)
        stream.expect(True)
        assert not hung.done()
        said = len(stream.heard)
        within(MARGIN, lambda: len(stream.heard) >= said + 3, "repetitions")
        stream.expect(False)


def test_the_clock_stands_still_or_jumps(start_stream):
    """With use_sim_time and a /clock that never comes, then jumps forth and back: false stays false while frames come,
    and becomes true where they end."""
    stream = start_stream(use_sim_time=True, remaps=("/clock:=clock",))
    with found_clear(stream):
        clock = stream.node.peer.publisher(Clock, "clock")
        for seconds in (10**6, 1, 10**9):
            now = Clock(clock=fields.ns_to_stamp(seconds * 10**9))

            def reported(now=now):
                clock.publish(now)
                return stream.node.peer.reported_at == fields.stamp_to_ns(now.clock)

            stream.node.wait_until(reported, "report in the new time")
            stream.expect(False)
    within(SHORT + MARGIN, lambda: stream.listener.stop, "stop while /clock stands still")
    stream.status("silent")


def test_stamps_of_any_time(start_stream):
    """Stamps say nothing of how fresh a frame is: they may be of any time, and go in any steps."""
    stream = start_stream(timeout=TIMEOUT)
    stream.topologies()
    for stamp in (5, 10**18, 2 * 10**18, 2 * 10**18 + 1):
        stream.sent = stamp
        stream.frame(hand(2.0))
    stream.expect(False)
    stream.sent -= 10  # rejected, as it goes backward
    stream.frame(2.0)
    stream.expect(True)
    stream.status("rejected", "stamp_backward")
