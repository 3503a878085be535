# SPDX-License-Identifier: Apache-2.0
"""Frames of the hand above the table for a node with stop_distance, and the messages on stop."""

import contextlib
import threading
import time

import numpy as np
from hand_and_table import FACES, MESHES, TABLE, hand
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Bool

from hpccd_ros import client

NEAR = 0.25
TIMEOUT = 5.0  # s: above what a busy machine makes of a frame
SHORT = 0.5


class StopStream:
    """Publishes frames of the hand above the table, and receives stop in its own thread."""

    def __init__(self, node, timeout=TIMEOUT):
        self.node, self.sent = node, 0
        self.heard: list[tuple[float, bool]] = []
        self._node = Node("watcher", namespace=node.namespace, context=node.peer.context)
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
        self.node.frames_status(processed=2 * (count or self.sent))

    def start(self, heights=(2.0, 1.0)):
        """From the topologies to a stop that is false."""
        self.topologies()
        for height in heights:
            self.frame(height)
        self.expect(False)

    @contextlib.contextmanager
    def steady(self, height=2.0, period=0.05):
        """A context in which another thread sends a frame every `period` seconds."""
        ended = threading.Event()

        def send():
            while not ended.wait(period):
                self.frame(height)

        sender = threading.Thread(target=send)
        sender.start()
        try:
            yield
        finally:
            ended.set()
            sender.join()

    def expect(self, stop):
        """Wait until it is said."""
        self.node.wait_until(lambda: self.heard and self.heard[-1][1] == stop, f"stop {stop}")

    def status(self, cause, text=""):
        """Wait until the diagnostics tell this cause; their values."""

        def told():
            level, message, values = self.node.peer.statuses.get("stop", (b"", "", {}))
            return values if values.get("cause") == cause and text in message else None

        return self.node.wait_until(told, f"cause {cause!r} with {text!r}")


@contextlib.contextmanager
def started(start_node, timeout=TIMEOUT, *, program=None, remaps=(), **parameters):
    """A stream with a node that `start_node` starts.

    Up to three frames may wait. With a shorter queue, a detection thread that starts late gets only the newest of the
    frames that a test publishes at once; with a longer one, frames of a steady stream would be too old.
    """
    given = {"meshes": list(MESHES), "stop_distance": NEAR, "stop_timeout": timeout, "frame_queue": 3, **parameters}
    stream = StopStream(start_node(given, program=program, remaps=remaps), timeout)
    try:
        yield stream
    finally:
        stream.close()
