# SPDX-License-Identifier: Apache-2.0
"""Play a scene over DDS, as a simulation would stream it, and wait for the node's results where that is asked for."""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Sequence

import rclpy
from hpccd.msg import ContactArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions

from hpccd_core.progress import track
from hpccd_ros.middleware import environment, qos, stop_signals, topic_names
from hpccd_ros.middleware.fields import stamp_to_ns
from hpccd_ros.middleware.listeners import await_acknowledged, await_subscribers
from hpccd_ros.middleware.message_types import message_class
from hpccd_ros.scenes import messages
from hpccd_ros.scenes.messages import Player
from hpccd_ros.scenes.scene import Scene

# Seconds between the arrival of the static meshes and the first frame.
SETTLE = 0.2
# Seconds that the last frame may take on its way.
LAST = 2.0
STREAM = qos.vertices("reliable", 10)

# Where each frame is awaited: a history that one message fills makes the middleware ask for its acknowledgement at
# once, and not with its next heartbeat (3 s).
AWAITED = qos.vertices("reliable", 1)


def publish(
    scene: Scene,
    rate: float,
    loop: bool = False,
    wait: float = 10.0,
    ros_args: list[str] | None = None,
    progress: bool = False,
    subscribers: int = 1,
    await_results: bool = False,
) -> int:
    """Publish all frames at `rate` Hz (over and over if `loop`); return how many. SIGINT and SIGTERM end it.

    Before the first frame, waits up to `wait` seconds until every mesh's vertices and every robot's joint states have
    `subscribers`; before what moves, until these have acknowledged what does not; before the second frame, the first.
    await_results: no frame before all have the one before and the node has processed its step, each awaited up to
    `wait` seconds: where the machine is too slow for `rate`, the scene plays slower and nothing is dropped.
    """
    with stop_signals.collected() as stop:
        environment.prepare()
        rclpy.init(args=["--ros-args", *ros_args] if ros_args else None, signal_handler_options=SignalHandlerOptions.NO)
        node = rclpy.create_node("hpccd_scene", start_parameter_services=False)
        results = Results(node) if await_results else None
        try:
            publishers, listened = {}, {}
            for topic in messages.topics(scene):
                stream = AWAITED if await_results else STREAM
                publisher = node.create_publisher(
                    message_class(topic.type_name), topic.name, qos.TOPOLOGY if topic.latched else stream
                )
                publishers[topic.name] = publisher
                if not topic.latched:
                    listened[topic.name] = publisher
            if await_subscribers(listened, subscribers, wait, stop) and not stop:
                text = f"not every mesh or robot has {subscribers} subscriber(s) yet: publishing all the same"
                print(text, file=sys.stderr, flush=True)
            if results is not None and not results.await_node(wait, stop) and not stop:
                print("no node publishes contacts: publishing all the same", file=sys.stderr, flush=True)
            count = _play(node, scene, publishers, results, rate, loop, wait, stop, progress)
            # The end of this process must not cut off messages in transport.
            await_acknowledged(publishers.values(), LAST)
            return count
        finally:
            if results is not None:
                results.close()
            node.destroy_node()
            rclpy.try_shutdown()


def _play(node, scene, publishers, results, rate, loop, wait, stop, progress) -> int:
    player = Player(scene)
    first_moving = messages.first_moving(scene)
    begin_ns, begin = node.get_clock().now().nanoseconds, time.monotonic()
    count = 0
    for _ in itertools.count() if loop else range(1):
        for frame in track(scene.frames(), f"publishing {scene.name}", progress, scene.n_frames):
            # Stamps keep the rate exactly, whenever this process is woken.
            stamp = begin_ns + round(count * 1e9 / rate)
            sent = list(player.messages(frame, stamp))
            _sleep_until(begin + count / rate, stop)
            if stop:
                return count
            for message in sent:
                if count == 0 and message.topic == first_moving:
                    # Nothing orders topics among one another: let the ground arrive before what falls on it.
                    arrived = await_acknowledged(publishers.values(), wait, stop)
                    _sleep_until(time.monotonic() + SETTLE, stop)
                    begin += arrived + SETTLE
                publishers[message.topic].publish(message.data)
            if count == 0:
                begin += await_acknowledged(publishers.values(), wait, stop)
            count += 1
            if results is not None:
                results = _await_result(results, publishers, frame, stamp, wait, stop)
                # Lost time is not made up for: frames that follow at once would wait for each other.
                begin = max(begin, time.monotonic() - count / rate)
    return count


def _await_result(results, publishers, frame, stamp, wait, stop):
    """Wait until all have the frame and its step is processed; returns `results`, or None to wait no more."""
    await_acknowledged(publishers.values(), wait, stop)
    # The first frame, and the first with another topology, only begins the next step.
    if frame.index == 0 or frame.topologies or results.await_step(stamp, wait, stop) or stop:
        return results
    print(f"frame {frame.index} is not processed in {wait:g} s: publishing by the clock", file=sys.stderr, flush=True)
    return None


def _sleep_until(instant, stop) -> None:
    # In short pieces: a sleep goes on after a signal, and at a low rate Ctrl-C would take effect late.
    while not stop and (left := instant - time.monotonic()) > 0:
        time.sleep(min(left, 0.1))


class Results:
    """Listens to `contacts` through `node`. Make it before the publishers: the node then knows this listener before
    it has the first frame."""

    def __init__(self, node: Node):
        # Late ones of other frames may lie before the one that is waited for.
        self._subscription = node.create_subscription(
            ContactArray, topic_names.CONTACTS, self._take, QoSProfile(depth=100)
        )
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._stamp = -1

    def close(self) -> None:
        self._executor.shutdown()

    def await_node(self, wait: float, stop: Sequence = ()) -> bool:
        """Wait until something publishes contacts, `wait` s at most or until `stop` is filled."""
        return self._spin_until(lambda: self._subscription.get_publisher_count() > 0, wait, stop)

    def await_step(self, stamp: int, wait: float, stop: Sequence = ()) -> bool:
        """Wait until the step that ends at `stamp` (ns), or a later one, is processed; like `await_node`."""
        return self._spin_until(lambda: self._stamp >= stamp, wait, stop)

    def _spin_until(self, ready, wait, stop) -> bool:
        deadline = time.monotonic() + wait
        while not ready():
            if stop or time.monotonic() >= deadline:
                return False
            self._executor.spin_once(timeout_sec=0.05)
        return True

    def _take(self, message: ContactArray) -> None:
        self._stamp = max(self._stamp, stamp_to_ns(message.header.stamp))
