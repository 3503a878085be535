# SPDX-License-Identifier: Apache-2.0
"""Fewer turns, and yet nothing is left undone: what other threads and callbacks ask for, and warnings about QoS."""

import contextlib
import os
import threading
import time

import pytest
import rclpy
import rclpy.executors
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.context import Context
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.task import Future
from std_msgs.msg import Header

from hpccd_ros.middleware import environment, executors
from hpccd_ros.middleware.executors import LeanExecutor

PATIENCE = 60.0


@contextlib.contextmanager
def _spun(executor_type):
    """An executor, and a node that it runs in a thread of its own."""
    environment.prepare()
    context = Context()
    rclpy.init(context=context)
    node = rclpy.create_node("lean", context=context, namespace=f"/lean{os.getpid()}")
    executor = executor_type(context=context)
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    try:
        yield executor, node
    finally:
        executor.shutdown()
        thread.join(PATIENCE)
        node.destroy_node()
        context.try_shutdown()
    assert not thread.is_alive(), "the executor has not heard of its end"


@pytest.fixture
def spinning():
    with _spun(LeanExecutor) as (executor, node):
        yield executor, node


def _wait(until):
    deadline = time.monotonic() + PATIENCE
    while not until():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def _asleep(executor):
    """Once it waits with nothing to do."""
    done = Future()
    executor.create_task(lambda: done.set_result(None))
    _wait(done.done)
    time.sleep(0.2)


def test_another_thread_ends_a_wait(spinning):
    executor, node = spinning
    for _ in range(3):
        _asleep(executor)
        came = threading.Event()
        executor.create_task(came.set)
        assert came.wait(PATIENCE)


def test_entities_that_another_thread_makes_are_heard(spinning):
    executor, node = spinning
    _asleep(executor)
    came = []
    node.create_subscription(Header, "late", lambda message: came.append(message.frame_id), 10)
    publisher = node.create_publisher(Header, "late", 10)
    _wait(publisher.get_subscription_count)
    publisher.publish(Header(frame_id="a"))
    _wait(lambda: came == ["a"])


def test_entities_and_tasks_that_a_callback_makes_are_heard(spinning):
    executor, node = spinning
    came = []

    def first(message):
        node.create_subscription(Header, "second", lambda message: came.append(message.frame_id), 10)
        executor.create_task(lambda: came.append("task"))

    node.create_subscription(Header, "first", first, 10)
    publishers = [node.create_publisher(Header, topic, 10) for topic in ("first", "second")]
    _wait(publishers[0].get_subscription_count)
    publishers[0].publish(Header())
    _wait(publishers[1].get_subscription_count)
    publishers[1].publish(Header(frame_id="b"))
    _wait(lambda: sorted(came) == ["b", "task"])


def test_a_callback_that_waits_for_others_goes_on(spinning):
    """As an action's does: it awaits what a later message brings."""
    executor, node = spinning
    brought, came = Future(executor=executor), []

    async def waits(message):
        came.append(await brought)

    node.create_subscription(Header, "waits", waits, 10, callback_group=ReentrantCallbackGroup())
    node.create_subscription(Header, "brings", lambda message: brought.set_result(message.frame_id), 10)
    for topic, frame_id in (("waits", ""), ("brings", "c")):
        publisher = node.create_publisher(Header, topic, 10)
        _wait(publisher.get_subscription_count)
        publisher.publish(Header(frame_id=frame_id))
        time.sleep(0.2)
    _wait(lambda: came == ["c"])


def test_what_a_task_brings_forth_is_done(spinning):
    """The executor runs tasks right before it waits."""
    executor, _ = spinning
    brought, came = Future(executor=executor), []
    brought.add_done_callback(lambda _: came.append("told"))

    def brings():
        brought.set_result(None)
        executor.create_task(came.append, "task")

    _asleep(executor)
    executor.create_task(brings)
    _wait(lambda: sorted(came) == ["task", "told"])


def test_what_a_callback_brings_forth_after_it_waited_is_done(spinning):
    executor, node = spinning
    brought, came = Future(executor=executor), []

    async def waits(message):
        await brought
        executor.create_task(came.append, "task")

    node.create_subscription(Header, "waits", waits, 10)
    publisher = node.create_publisher(Header, "waits", 10)
    _wait(publisher.get_subscription_count)
    publisher.publish(Header())
    _asleep(executor)
    brought.set_result(None)
    executor.wake()
    _wait(lambda: came == ["task"])


def _turns(executor_type, messages=20):
    """How often it asks whether a subscription may be waited for, while this many messages come one by one."""
    came, asked = [], []
    with _spun(executor_type) as (executor, node):
        subscription = node.create_subscription(Header, "numbers", came.append, 10)
        can_execute = executor.can_execute
        executor.can_execute = lambda entity: (asked.append(entity), can_execute(entity))[1]
        publisher = node.create_publisher(Header, "numbers", 10)
        _wait(publisher.get_subscription_count)
        _asleep(executor)
        asked.clear()
        for number in range(messages):
            publisher.publish(Header())
            _wait(lambda count=number + 1: len(came) == count)
            time.sleep(0.02)
        return asked.count(subscription)


def test_a_message_takes_one_turn():
    """rclpy's own makes an empty one after each callback."""
    assert _turns(LeanExecutor) <= 30 < 35 <= _turns(rclpy.executors.SingleThreadedExecutor)


@pytest.mark.parametrize("talk", [False, True], ids=["idle", "busy"])
def test_incompatible_qos_is_told(spinning, capfd, talk):
    executor, node = spinning
    steady = Clock(clock_type=ClockType.STEADY_TIME)
    node.create_timer(0.5, lambda: None, clock=steady)
    if talk:
        node.create_timer(0.004, lambda: None, clock=steady)
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    node.create_subscription(Header, "odd", lambda message: None, 10)
    time.sleep(2 * executors.LOOK_EVERY)
    node.create_publisher(Header, "odd", best_effort)
    told, deadline = "", time.monotonic() + PATIENCE
    while not ("offering incompatible QoS" in told and "requesting incompatible QoS" in told):
        assert time.monotonic() < deadline, told
        told += "".join(capfd.readouterr())
        time.sleep(0.05)
