# SPDX-License-Identifier: Apache-2.0
"""Which subscriptions are said to have had messages that cannot be deserialised."""

import os
import time

import pytest
import rclpy
from rclpy.context import Context
from rclpy.duration import Duration
from std_msgs.msg import Header

from hpccd_ros.middleware import environment
from hpccd_ros.middleware.executors import UnreadableExecutor, watch_unreadable

PATIENCE = 60.0
UNREADABLE = b"\0\1\0\0" + b"\xff" * 50


@pytest.fixture
def spinning():
    """An executor and a node that it runs."""
    environment.prepare()
    context = Context()
    rclpy.init(context=context)
    node = rclpy.create_node("unreadable", context=context, namespace=f"/unreadable{os.getpid()}")
    executor = UnreadableExecutor(context=context)
    executor.add_node(node)
    yield executor, node
    executor.shutdown()
    node.destroy_node()
    context.try_shutdown()


def _send(node, topic, message):
    publisher = node.create_publisher(Header, topic, 10)
    deadline = time.monotonic() + PATIENCE
    while not publisher.get_subscription_count():
        assert time.monotonic() < deadline
        time.sleep(0.01)
    publisher.publish(message)
    assert publisher.wait_for_all_acked(Duration(seconds=PATIENCE))


def _spin(executor, until):
    deadline = time.monotonic() + PATIENCE
    while not until():
        assert time.monotonic() < deadline
        executor.spin_once(timeout_sec=0.1)


def test_what_cannot_be_deserialised(spinning):
    executor, node = spinning
    told = []
    watch_unreadable(node.create_subscription(Header, "first", lambda message: None, 10), lambda: told.append("first"))
    _send(node, "first", UNREADABLE)
    _spin(executor, lambda: told)


def test_a_subscription_that_ends_while_a_message_waits_had_none(spinning):
    """As where the node is deactivated: it was ready, and is gone when its turn comes."""
    executor, node = spinning
    told, heard = [], []

    def end_the_other(message):
        heard.append(message)
        node.destroy_subscription(second)

    node.create_subscription(Header, "first", end_the_other, 10)
    second = node.create_subscription(Header, "second", heard.append, 10)
    watch_unreadable(second, lambda: told.append("second"))
    for topic in ("second", "first"):
        _send(node, topic, Header())
    _spin(executor, lambda: heard)
    for _ in range(5):
        executor.spin_once(timeout_sec=0.1)
    assert len(heard) == 1 and not told
