# SPDX-License-Identifier: Apache-2.0
"""Subscriptions to one mesh: each message is counted, checked, turned into arrays and pushed into the pipeline."""

import time
from collections.abc import Callable
from typing import Any

from hpccd.msg import MeshTopology
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from hpccd_ros.detect.core import unusable_topology
from hpccd_ros.frames.drops import Input, Reason, Refusal
from hpccd_ros.frames.pipeline import FramePipeline
from hpccd_ros.frames.rate_limit import RateLimit
from hpccd_ros.frames.sequence import SequenceWatch
from hpccd_ros.frames.welding import Welding
from hpccd_ros.middleware import mesh_inputs, qos, qos_overrides, topic_names, unreadable
from hpccd_ros.middleware.fields import InvalidMessageError
from hpccd_ros.node.accounts import Accounts
from hpccd_ros.node.hand_over import hand_over

_UNREADABLE = "a message cannot be deserialised; build its publisher with the same definition of the message"


class MeshSubscriptions:
    """Topology and vertices of one mesh, subscribed from construction until ``close``.

    kind: one of topic_names.POSITIONS, what its vertices come as.
    """

    def __init__(
        self,
        node: Node,
        mesh: str,
        kind: str,
        settings: dict[str, Any],
        pipeline: FramePipeline,
        accounts: Accounts,
    ) -> None:
        self._node = node
        self._mesh = mesh
        self._kind = kind
        self._settings = settings
        self._pipeline = pipeline
        self._accounts = accounts
        self._topology_numbers, self._vertex_numbers = SequenceWatch(), SequenceWatch()
        self._topology_limit, self._vertex_limit = (RateLimit(settings["max_rate"]) for _ in range(2))
        self._welding = Welding()
        self._unreadable = 0  # vertex messages counted as such since the last that was read
        vertex_qos = qos.vertices(settings["input_reliability"], settings["input_depth"])
        self._subscriptions = [
            self._subscribe("topology", self._on_topology, qos.TOPOLOGY_INPUT, self._topology_numbers),
            self._subscribe(kind, self._on_vertices, vertex_qos, self._vertex_numbers),
        ]
        topologies, vertices = self._subscriptions
        unreadable.watch(topologies, self._on_unreadable_topology)
        unreadable.watch(vertices, self._on_unreadable)
        self._topology_topic, self._vertex_topic = topologies.topic_name, vertices.topic_name

    def close(self) -> None:
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._subscriptions.clear()

    def warnings(self) -> list[str]:
        """What is odd about the publishers of the mesh."""
        publishers = self._publishers()
        several = [f"{publishers} publishers on {self._vertex_topic}"] if publishers > 1 else []
        return several + self._pipeline.awaited_transform(self._mesh)

    def _publishers(self) -> int:
        """Of vertices, as far as is known."""
        return self._node.count_publishers(self._vertex_topic)

    def _on_topology(self, message: MeshTopology, info: dict[str, Any]) -> None:
        _, new_publisher = self._topology_numbers.next(info["publication_sequence_number"])
        if not self._topology_limit.allows():
            self._refuse_topology(Reason.RATE, self._too_fast())
            return
        try:
            topology = mesh_inputs.read("topology", message, self._settings)
        except InvalidMessageError as error:
            self._accounts.refused(error.refusal(self._mesh, Input.TOPOLOGY))
            return
        if why := unusable_topology(topology):
            self._refuse_topology(Reason.BAD_TOPOLOGY, why)
            return
        hand_over(self._pipeline.push(self._mesh, topology, new_publisher), self._pipeline, self._accounts)

    def _on_vertices(self, message: Any, info: dict[str, Any]) -> None:
        received = time.monotonic()
        self._count_received(info)
        if not self._vertex_limit.allows():
            self._refuse(Reason.RATE, self._too_fast())
            return
        # Asked only where it can matter, as it takes 4 us: of a frame in another frame_id, which may be a restart.
        here = hasattr(message, "header") and message.header.frame_id == self._pipeline.coordinate_frame[0]
        alone = here or self._publishers() <= 1
        sent = info["source_timestamp"]
        try:
            frame = mesh_inputs.read(
                self._kind, message, self._settings, received, alone, sent=sent, welding=self._welding
            )
        except InvalidMessageError as error:
            self._accounts.refused(error.refusal(self._mesh))
            return
        outcome = self._pipeline.push(self._mesh, frame, self._vertex_numbers.notice())
        hand_over(outcome, self._pipeline, self._accounts)

    def _count_received(self, info: dict[str, Any]) -> None:
        transport = (info["received_timestamp"] - info["source_timestamp"]) * 1e-6
        self._accounts.metrics.frame_received(self._mesh, transport if transport >= 0 else None)
        missing, _ = self._vertex_numbers.next(info["publication_sequence_number"])
        unreadable, self._unreadable = self._unreadable, 0
        self._accounts.connections[f"before_first.{self._mesh}"] = self._vertex_numbers.before_first
        # Numbers of several publishers interleave: their gaps mean nothing.
        if missing <= unreadable or self._publishers() > 1:
            return
        missing -= unreadable
        if unreadable:  # some of the same gap were, so that these are taken for unreadable too
            self._count_unreadable(missing)
            return
        text = (
            f"{missing} messages did not reach the node: they came faster than it reads (parameter input_depth) or "
            "could not be deserialised (see the log of DDS)"
        )
        self._refuse(Reason.MIDDLEWARE, text, missing)

    def _on_unreadable(self) -> None:
        self._unreadable += 1
        self._count_unreadable(1)

    def _count_unreadable(self, messages: int) -> None:
        self._accounts.metrics.frame_received(self._mesh, None, messages)
        self._refuse(Reason.MALFORMED, f"{self._vertex_topic}: {_UNREADABLE}", messages)

    def _on_unreadable_topology(self) -> None:
        self._refuse_topology(Reason.MALFORMED, f"{self._topology_topic}: {_UNREADABLE}")

    def _refuse(self, reason: Reason, text: str, messages: int = 1) -> None:
        self._accounts.refused(Refusal(self._mesh, reason, text, messages))

    def _refuse_topology(self, reason: Reason, text: str) -> None:
        self._accounts.refused(Refusal(self._mesh, reason, text, what=Input.TOPOLOGY))

    def _too_fast(self) -> str:
        return f"more than {self._settings['max_rate']:g} messages a second (parameter max_rate)"

    def _subscribe(self, kind: str, callback: Callable, profile: QoSProfile, numbers: SequenceWatch) -> Subscription:
        topic = topic_names.of_mesh(self._mesh, kind)
        return qos_overrides.create_subscription(
            self._node,
            mesh_inputs.TYPES[kind],
            topic,
            callback,
            profile,
            event_callbacks=self._events(topic, numbers),
            raw=kind in topic_names.WHOLE,
        )

    def _events(self, topic: str, numbers: SequenceWatch) -> SubscriptionEventCallbacks:
        """Count and log what the middleware reports of a subscription."""
        connections = self._accounts.connections

        def incompatible(event: Any) -> None:
            connections[f"qos_incompatible.{topic}"] += event.total_count_change
            self._node.get_logger().warning(
                f"{topic}: a publisher offers an incompatible QoS (policy {event.last_policy_kind}) and is "
                "not heard; see parameter input_reliability"
            )

        def lost(event: Any) -> None:
            connections[f"message_lost.{topic}"] += event.total_count_change

        def matched(event: Any) -> None:
            if event.current_count_change > 0:
                numbers.new_publisher()

        return SubscriptionEventCallbacks(incompatible_qos=incompatible, message_lost=lost, matched=matched)
