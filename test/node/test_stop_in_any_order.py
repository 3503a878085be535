# SPDX-License-Identifier: Apache-2.0
"""`stop` of a node as a process, over DDS, after random sequences of events; a small model decides what is allowed."""

import contextlib
import math
import signal
import time

import pytest
import stop_stream
from hypothesis import HealthCheck, Phase, settings
from hypothesis.stateful import RuleBasedStateMachine, precondition, rule, run_state_machine_as_test
from lifecycle_msgs.msg import Transition
from node_calls import change_state, set_parameter

from hpccd_ros.middleware import fields

TIMEOUT = 2.0
FAR, BETWEEN, CLOSE = 3.0, 1.0, 0.1  # heights of the hand above the table
DISTANCES = 0.25, 1.5  # BETWEEN is near for the second
OVER = 1.2 * TIMEOUT
PROMPT = TIMEOUT + 20.0  # s: it was promised within TIMEOUT, and messages of a busy machine arrive late


class StopMachine(RuleBasedStateMachine):
    """``heights``: of the hand in the valid frames since the stream began, or what is said about a step that is no
    longer known. ``unknown``: since the last valid frame, a frame was rejected or too much time has passed."""

    stream: stop_stream.StopStream

    def __init__(self):
        super().__init__()
        self.heights, self.unknown, self.active = [], True, True
        self.distance = DISTANCES[0]
        self.heard = len(self.stream.heard)
        set_parameter(self.stream.node, "stop_distance", self.distance)
        self.stream.topologies()
        self.clear()

    def allowed(self):
        """Whether stop may be false: the last step is known, and neither of its ends is near."""
        known = self.active and not self.unknown and len(self.heights) >= 2
        return known and min(self.heights[-2:]) > self.distance

    def settle(self):
        """Where stop must be true it becomes so, and stays so until it may be false again."""
        if self.allowed():  # it becomes false with the next frame
            return
        since, stream = time.monotonic(), self.stream
        stream.expect(True)
        assert time.monotonic() - since < PROMPT
        self.heard = len(stream.heard)
        stream.node.wait_until(lambda: len(stream.heard) >= self.heard + 2, "repetitions of stop")
        assert all(said for _, said in stream.heard[self.heard :]), "stop became false, and nothing allowed it"
        self.heard = len(stream.heard)

    def teardown(self):
        if not self.active:
            self.activate()

    @rule()
    @precondition(lambda self: self.active)
    def clear(self):
        self.heights, self.unknown = [FAR, FAR], False
        self.become_false(FAR)

    def become_false(self, height):
        """Frames arrive until stop is false, which it must become. Afterwards none waits for its detection."""
        stream = self.stream
        with stream.steady(height):
            stream.expect(False)
        received = stream.node.peer.received
        stream.node.wait_until(
            lambda: received and fields.stamp_to_ns(received[-1].header.stamp) == stream.sent, "the last step"
        )

    def frame(self, height):
        if math.isnan(height):
            self.unknown = True
        elif self.active:
            self.heights.append(height)
            self.unknown = False
        if self.allowed() and not math.isnan(height):
            self.become_false(height)
        else:
            self.stream.frame(height)
            self.settle()

    @rule()
    def far(self):
        self.frame(FAR)

    @rule()
    def between(self):
        self.frame(BETWEEN)

    @rule()
    def close_by(self):
        self.frame(CLOSE)

    @rule()
    def reject(self):
        self.frame(math.nan)

    @rule()
    def new_topologies(self):
        self.stream.topologies(version=self.stream.sent)
        self.heights = []
        self.settle()

    @rule()
    def wait(self):
        time.sleep(OVER)
        self.unknown = True
        self.settle()

    @rule()
    def hold(self):
        """The node does not run for a while."""
        self.stream.node.process.send_signal(signal.SIGSTOP)
        time.sleep(OVER)
        self.stream.node.process.send_signal(signal.SIGCONT)
        self.unknown = True
        self.settle()

    @rule()
    def change_distance(self):
        larger = self.distance == DISTANCES[0]
        self.distance = DISTANCES[larger]
        assert set_parameter(self.stream.node, "stop_distance", self.distance).successful
        self.unknown = self.unknown or larger
        self.settle()

    @rule()
    @precondition(lambda self: self.active)
    def deactivate(self):
        assert change_state(self.stream.node, Transition.TRANSITION_DEACTIVATE)
        self.active = False
        self.settle()

    @rule()
    @precondition(lambda self: not self.active)
    def activate(self):
        assert change_state(self.stream.node, Transition.TRANSITION_ACTIVATE)
        self.active, self.heights = True, []
        self.settle()


@pytest.fixture
def machine(start_node):
    with contextlib.closing(contextlib.ExitStack()) as stack:
        StopMachine.stream = stack.enter_context(stop_stream.started(start_node, TIMEOUT, stop_distance=DISTANCES[0]))
        yield StopMachine


def run(machine, examples):
    run_state_machine_as_test(
        machine,
        settings=settings(
            max_examples=examples,
            stateful_step_count=8,
            deadline=None,
            derandomize=True,
            phases=[Phase.generate],  # each sequence takes seconds, which is too long to shrink it
            suppress_health_check=list(HealthCheck),
        ),
    )


def test_few_sequences(machine):
    run(machine, 3)


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_many_sequences(machine):
    run(machine, 40)
