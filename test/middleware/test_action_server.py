# SPDX-License-Identifier: Apache-2.0
"""The bounds of the action server, with a client beside it in this process."""

import os
import time

import pytest
import rclpy
from hpccd.action import Detect
from node_process import PATIENCE
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor

from hpccd_ros.middleware import qos
from hpccd_ros.middleware.action_server import BoundedActionServer

GOALS, ROOM = 5, 10
FORGOTTEN = "forgotten"


class Pair:
    """A server whose goals succeed at once with a message of the length that they ask for, and its client."""

    def __init__(self):
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node("pair", namespace=f"/bounds{os.getpid()}", context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.rejected = 0
        self.server = BoundedActionServer(
            self.node,
            Detect,
            "bounded",
            self._execute,
            goals=GOALS,
            room=ROOM,
            requests=qos.requests(100),
            rejected=self._count,
            forgotten=lambda result: setattr(result, "message", FORGOTTEN),
        )
        self.client = ActionClient(self.node, Detect, "bounded")
        assert self.client.wait_for_server(PATIENCE)

    def _count(self):
        self.rejected += 1

    async def _execute(self, goal):
        result = Detect.Result(message=goal.request.query)
        self.server.keep(goal, result, len(result.message))
        goal.succeed()
        return result

    def wait(self, future):
        deadline = time.monotonic() + PATIENCE
        while not future.done():
            assert time.monotonic() < deadline
            self.executor.spin_once(timeout_sec=0.1)
        return future.result()

    def send(self, query):
        return self.wait(self.client.send_goal_async(Detect.Goal(query=query)))

    def result(self, handle):
        return self.wait(handle.get_result_async()).result.message

    def close(self):
        self.client.destroy()
        self.server.destroy()
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def pair():
    pair = Pair()
    yield pair
    pair.close()


def test_goals_beyond_the_bound_are_rejected(pair):
    """Those that have ended count too, as long as their results are kept."""
    accepted = [pair.send("a").accepted for _ in range(GOALS + 3)]
    assert accepted == [True] * GOALS + [False] * 3 and pair.rejected == 3


def test_the_oldest_results_give_way(pair):
    handles = [pair.send(query) for query in ("a" * 6, "b" * 4, "c" * 3)]
    assert [pair.result(handle) for handle in handles] == [FORGOTTEN, "b" * 4, "c" * 3]
    large = pair.send("d" * 2 * ROOM)
    assert pair.result(large) == "d" * 2 * ROOM, "the last is kept whatever its size"
    assert [pair.result(handle) for handle in handles] == [FORGOTTEN] * 3


def test_requests_are_not_kept(pair):
    handle = pair.send("a")
    assert pair.result(handle) == "a"
    assert all(goal.request is None for goal in pair.server._goal_handles.values())


def test_finish_sends_the_results_that_are_asked_for_late(pair):
    """And accepts no goal any more."""
    handle = pair.send("a")
    asked, late = handle.get_result_async(), pair.client.send_goal_async(Detect.Goal(query="b"))
    pair.server.finish(pair.executor, 0.5)
    assert pair.wait(asked).result.message == "a"
    assert not pair.wait(late).accepted and pair.rejected == 1


def test_finish_waits_no_longer_than_told(pair):
    """Not for clients that never ask for the result."""
    pair.send("a")
    pair.executor.spin_once(timeout_sec=0.1)
    pair.server.finish(pair.executor, 0.01)
