# SPDX-License-Identifier: Apache-2.0
"""The status that the demo shows while it runs, received over DDS."""

import time
from collections import Counter

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from hpccd.msg import ContactArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions

from hpccd_ros.middleware import environment, stop_signals, topic_names


class Monitor:
    """Listens to `contacts` and to the diagnostics of the node.

    results: steps that the node has processed so far. step, contacts, first_toc: of the last one received. most:
    largest number of contacts and its step. dropped: frames dropped by the node. core_ms: median of the core's time for
    a frame, None until the node has reported it. first_received, last_received: when the first and the last result was
    received (monotonic, s).
    """

    def __init__(self):
        environment.prepare()
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        self._node = rclpy.create_node("hpccd_demo", start_parameter_services=False)
        self._contacts = self._node.create_subscription(
            ContactArray, topic_names.CONTACTS, self._on_contacts, QoSProfile(depth=100)
        )
        self._node.create_subscription(
            DiagnosticArray, topic_names.DIAGNOSTICS, self._on_diagnostics, QoSProfile(depth=10)
        )
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._received = 0
        self.results = self.step = self.contacts = self.dropped = 0
        self.first_toc = float("inf")
        self.most = (0, 0)
        self.core_ms: float | None = None
        self.first_received = self.last_received = time.monotonic()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.try_shutdown()

    def nodes_called(self, name: str) -> bool:
        """Whether the graph contains a node with this full name."""
        return any(f"{ns.rstrip('/')}/{n}" == name for n, ns in self._node.get_node_names_and_namespaces())

    def receives_contacts(self) -> bool:
        """Whether a publisher of contacts is connected to this listener."""
        return self._contacts.get_publisher_count() > 0

    def listen(self, seconds: float) -> None:
        """Spin for `seconds`."""
        end = time.monotonic() + seconds
        with stop_signals.later():
            while (left := end - time.monotonic()) > 0:
                self._executor.spin_once(timeout_sec=left)

    def _on_contacts(self, message):
        self._received += 1
        self._count(self._received)
        self.step, self.contacts, self.first_toc = message.step, message.total, message.first_toc
        self.dropped = max(self.dropped, message.dropped_frames)
        self.most = max(self.most, (message.total, message.step), key=lambda pair: pair[0])

    def _on_diagnostics(self, message):
        for status in message.status:
            values = {pair.key: pair.value for pair in status.values}
            if status.name.endswith(": detection") and "detect_ms.p50" in values:
                self.core_ms = float(values["detect_ms.p50"])
                # This process may be late for some of the results themselves; the node's own count misses none.
                self._count(int(values["detections"]))
            elif status.name.endswith(": frames"):
                self.dropped = max([self.dropped, *_dropped(values).values()])

    def _count(self, results):
        if results > self.results:
            self.last_received = time.monotonic()
            if self.results == 0:
                self.first_received = self.last_received
            self.results = results


def _dropped(values) -> Counter:
    """Vertex messages dropped of each mesh: a frame of the scene has one of each, so that their sum says too much."""
    dropped = Counter()
    for key, value in values.items():
        word, _, rest = key.partition(".")
        mesh, of_mesh, _ = rest.rpartition(".")
        if word == "dropped" and of_mesh:
            dropped[mesh] += int(value)
    return dropped
