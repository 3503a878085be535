# SPDX-License-Identifier: Apache-2.0
"""The topic speed_scale of a node as a process: below 1 as meshes approach, 0 while stop is true or in silence."""

import contextlib
import signal
import time

import numpy as np
import pytest
import stop_stream
from node_calls import set_parameter
from stop_stream import NEAR, SHORT, TIMEOUT

from hpccd_ros import client

APPROACH_TIME = 5.0


@pytest.fixture
def start_scaled(start_node):
    """Function that starts a node; returns (stream, listener to speed_scale)."""
    with contextlib.ExitStack() as stack:

        def start(timeout=TIMEOUT, **parameters):
            stream = stack.enter_context(
                stop_stream.started(start_node, timeout, **{"approach_time": APPROACH_TIME, **parameters})
            )
            return stream, client.SpeedScaleListener(stream._node, stop_timeout=timeout)

        yield start


def frame(stream, height):
    """One second after the last one, by its stamp."""
    stream.sent += 10**9 - 1
    stream.frame(height)


def expect(stream, listener, scale):
    stream.node.wait_until(
        lambda: listener.speed_scale == pytest.approx(scale, abs=1e-12), f"{scale}, not {listener.speed_scale}"
    )


def test_the_nearer_the_slower(start_scaled):
    """0.25 a second: 1.25 in the time of approach."""
    stream, listener = start_scaled()
    stream.topologies()
    assert listener.speed_scale == 0
    frame(stream, 1.75)
    stream.status("unanswered")
    assert listener.speed_scale == 0, "nothing is known of the motion to the first frame"
    for height, scale in ((1.5, 1.0), (1.25, 0.8), (1.0, 0.6), (1.0, 1.0), (0.75, 0.4), (1.0, 1.0), (0.5, 0.1)):
        frame(stream, height)
        expect(stream, listener, scale)
        assert not listener.stop
    values = stream.status("", "false: nothing is near; speed_scale 0.1: hand and table approach")
    assert (values["speed_scale"], values["slowed_by"], values["approach_time"]) == ("0.1", "hand and table", "5.0")
    frame(stream, NEAR)
    expect(stream, listener, 0)
    assert stream.status("near")["speed_scale"] == "0.0"
    frame(stream, 2.0)
    frame(stream, 2.0)
    expect(stream, listener, 1)
    stream.node.peer.vertices("hand", np.full((3, 3), np.nan), stamp=stream.sent + 1)
    expect(stream, listener, 0)
    stream.status("rejected")
    stream.sent += 1
    frame(stream, 2.0)
    expect(stream, listener, 1)


def test_what_fails_makes_it_zero(start_scaled):
    """Frames that stop coming, a process that is stopped, and one that has died."""
    stream, listener = start_scaled(SHORT)
    stream.topologies()
    with stream.steady():
        expect(stream, listener, 1)
    expect(stream, listener, 0)
    stream.status("silent")
    with stream.steady():
        expect(stream, listener, 1)
        stream.node.process.send_signal(signal.SIGSTOP)
        expect(stream, listener, 0)
        stream.node.process.send_signal(signal.SIGCONT)
        expect(stream, listener, 1)
        stream.node.process.kill()
        stream.node.process.wait()
        time.sleep(SHORT)
        assert listener.speed_scale == 0


def test_its_parameter(start_scaled):
    """A longer time counts from the next result on; the topic comes and goes with the configuration only."""
    stream, listener = start_scaled()
    stream.topologies()
    for height in (2.0, 1.5, 1.25):
        frame(stream, height)
    expect(stream, listener, 0.8)
    assert set_parameter(stream.node, "approach_time", 10.0).successful
    expect(stream, listener, 0)
    assert not stream.listener.stop
    frame(stream, 1.0)
    expect(stream, listener, 0.3)
    refused = set_parameter(stream.node, "approach_time", 0.0)
    assert not refused.successful and "would switch the topic speed_scale on or off" in refused.reason
    refused = set_parameter(stream.node, "stop_distance", -1.0)
    assert not refused.successful


def test_without_it_there_is_no_topic(start_scaled):
    stream, listener = start_scaled(approach_time=0.0)
    stream.start()
    assert listener.speed_scale == 0 and "no message yet" in listener.reason
    assert stream.node.peer.node.count_publishers(f"{stream.node.namespace}/speed_scale") == 0
