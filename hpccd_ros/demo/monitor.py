# SPDX-License-Identifier: Apache-2.0
"""What the demo shows while it runs, heard over DDS like any other listener would."""

import time

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from hpccd.msg import ContactArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions

from hpccd_ros import _env, stop_signals


class Monitor:
    """Listens to `contacts` and to the diagnostics of the node.

    answers: contact messages so far. step, contacts, first_toc: of the last one. most: largest number of contacts and
    its step. dropped: vertex messages dropped by the node. core_ms: median of the core's time for a frame, None until
    the node has told it.
    """

    def __init__(self):
        _env.prepare()
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        self._node = rclpy.create_node("hpccd_demo", start_parameter_services=False)
        self._node.create_subscription(ContactArray, "contacts", self._on_contacts, QoSProfile(depth=100))
        self._node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, QoSProfile(depth=10))
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self.answers = self.step = self.contacts = self.dropped = 0
        self.first_toc = float("inf")
        self.most = (0, 0)
        self.core_ms: float | None = None
        self.heard = time.monotonic()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.try_shutdown()

    def nodes_called(self, name: str) -> bool:
        """Whether a node with this full name is in the network."""
        return any(f"{ns.rstrip('/')}/{n}" == name for n, ns in self._node.get_node_names_and_namespaces())

    def listen(self, seconds: float) -> None:
        """Take what comes within `seconds`."""
        end = time.monotonic() + seconds
        with stop_signals.later():
            while (left := end - time.monotonic()) > 0:
                self._executor.spin_once(timeout_sec=left)

    def _on_contacts(self, message):
        self.heard = time.monotonic()
        self.answers += 1
        self.step, self.contacts, self.first_toc = message.step, message.total, message.first_toc
        self.dropped = max(self.dropped, message.dropped_frames)
        self.most = max(self.most, (message.total, message.step), key=lambda pair: pair[0])

    def _on_diagnostics(self, message):
        for status in message.status:
            values = {pair.key: pair.value for pair in status.values}
            if status.name.endswith(": detection") and "detect_ms.p50" in values:
                self.core_ms = float(values["detect_ms.p50"])
            elif status.name.endswith(": frames") and "dropped" in values:
                self.dropped = max(self.dropped, int(values["dropped"]))
