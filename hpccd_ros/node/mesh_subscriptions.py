# SPDX-License-Identifier: Apache-2.0
"""Subscriptions of the meshes: each message is checked, turned into arrays and handed to the assembler."""

import time
from collections import Counter
from collections.abc import Callable
from typing import Any

from hpccd.msg import MeshTopology, MeshVertices
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.subscription import Subscription
from sensor_msgs.msg import PointCloud2

from hpccd_ros.frames.assembler import FrameAssembler
from hpccd_ros.frames.drops import DropCounter, Reason
from hpccd_ros.frames.rate_limit import RateLimit
from hpccd_ros.frames.sequence import SequenceWatch
from hpccd_ros.frames.transformer import Placement, Ready
from hpccd_ros.frames.types import MeshFrame, SceneFrame, Topology
from hpccd_ros.middleware import fields, mesh_messages, qos, qos_overrides, unreadable
from hpccd_ros.middleware.fields import InvalidMessageError
from hpccd_ros.node.status_report import Metrics

_UNREADABLE = "a message cannot be deserialised; build its publisher with the same definition of the message"


def link_events(
    node: Node, topic: str, links: Counter, on_matched: Callable[[], None] = lambda: None
) -> SubscriptionEventCallbacks:
    """Count and log what the middleware reports of a subscription; ``on_matched``: a publisher came."""

    def incompatible(event: Any) -> None:
        links[f"qos_incompatible.{topic}"] += event.total_count_change
        node.get_logger().warning(
            f"{topic}: a publisher offers an incompatible QoS (policy {event.last_policy_kind}) and is "
            "not heard; see parameter input_reliability"
        )

    def lost(event: Any) -> None:
        links[f"message_lost.{topic}"] += event.total_count_change

    def matched(event: Any) -> None:
        if event.current_count_change > 0:
            on_matched()

    return SubscriptionEventCallbacks(incompatible_qos=incompatible, message_lost=lost, matched=matched)


class MeshStream:
    """The topology and vertex subscriptions of one mesh, from construction until ``close``.

    placement: brings positions into the scene's frame.
    on_frames: takes the scene frames that a message completes.
    check_topology: why the core refuses a topology, or None.
    """

    def __init__(
        self,
        node: Node,
        mesh: str,
        kind: str,
        settings: dict[str, Any],
        *,
        placement: Placement,
        assembler: FrameAssembler,
        drops: DropCounter,
        refused: DropCounter,
        metrics: Metrics,
        links: Counter,
        on_frames: Callable[[list[SceneFrame]], None],
        check_topology: Callable[[Topology], str | None],
    ) -> None:
        self._node = node
        self._mesh = mesh
        self._settings = settings
        self._placement = placement
        self._assembler = assembler
        self._drops = drops
        self._refused = refused
        self._metrics = metrics
        self._links = links
        self._on_frames = on_frames
        self._check_topology = check_topology
        self._topology_numbers = SequenceWatch()
        self._vertex_numbers = SequenceWatch()
        self._unnoticed = False  # the first message of a new publisher was refused: the next one stands for it
        self._topology_limit, self._vertex_limit = (RateLimit(settings["max_rate"]) for _ in range(2))
        message, callback = {
            "vertices": (MeshVertices, self._on_vertices),
            "points": (PointCloud2, self._on_cloud),
        }[kind]
        topology_topic, vertex_topic = f"meshes/{mesh}/topology", f"meshes/{mesh}/{kind}"
        self._subscriptions: list[Subscription] = [
            qos_overrides.create_subscription(
                node,
                MeshTopology,
                topology_topic,
                self._on_topology,
                qos.TOPOLOGY_INPUT,
                event_callbacks=link_events(node, topology_topic, links, self._topology_numbers.new_publisher),
            ),
            qos_overrides.create_subscription(
                node,
                message,
                vertex_topic,
                callback,
                qos.vertices(settings["input_reliability"], settings["input_depth"]),
                event_callbacks=link_events(node, vertex_topic, links, self._vertex_numbers.new_publisher),
            ),
        ]
        self._vertex_topic = self._subscriptions[1].topic_name
        self._unreadable = 0  # vertex messages counted as such since the last that was read
        for subscription, on_unreadable in zip(
            self._subscriptions, (self._on_unreadable_topology, self._on_unreadable), strict=True
        ):
            unreadable.watch(subscription, on_unreadable)

    def close(self) -> None:
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._subscriptions.clear()
        self._placement.clear(Reason.STOPPED)

    @property
    def waiting(self) -> int:
        """Messages that wait for a transform."""
        return self._placement.waiting

    @property
    def publishers(self) -> int:
        """Of vertices, as far as is known."""
        return self._node.count_publishers(self._vertex_topic)

    def retry(self) -> None:
        """Go on with frames that waited for a transform."""
        self._hand_on(self._placement.retry())

    def warnings(self) -> list[str]:
        """What is odd about the publishers of the mesh."""
        publishers = self.publishers
        several = [f"{publishers} publishers on {self._vertex_topic}"] if publishers > 1 else []
        return several + self._placement.warnings()

    def _on_topology(self, message: MeshTopology, info: dict[str, Any]) -> None:
        _, new_publisher = self._topology_numbers.next(info["publication_sequence_number"])
        if not self._topology_limit.allows():
            self._refused.count(self._mesh, Reason.RATE, self._too_fast())
            return
        try:
            topology = mesh_messages.topology_from_message(
                message, self._settings["max_vertices"], self._settings["max_faces"]
            )
        except InvalidMessageError as error:
            self._refused.count(self._mesh, error.reason, str(error))
            return
        if why := self._check_topology(topology):
            self._refused.count(self._mesh, Reason.BAD_TOPOLOGY, why)
            return
        self._on_frames(self._assembler.set_topology(self._mesh, topology, new_publisher))

    def _on_vertices(self, message: MeshVertices, info: dict[str, Any]) -> None:
        self._take(message, info, mesh_messages.vertices_from_message, message.topology_version, message.step)

    def _on_cloud(self, message: PointCloud2, info: dict[str, Any]) -> None:
        self._take(message, info, mesh_messages.vertices_from_cloud, None, None)

    def _take(self, message: Any, info: dict[str, Any], read: Callable, version: int | None, step: int | None) -> None:
        received = time.monotonic()
        transport = (info["received_timestamp"] - info["source_timestamp"]) * 1e-6
        self._metrics.frame_received(self._mesh, transport if transport >= 0 else None)
        missing, new_publisher = self._vertex_numbers.next(info["publication_sequence_number"])
        self._unnoticed |= new_publisher
        counted, self._unreadable = self._unreadable, 0
        self._links[f"before_first.{self._mesh}"] = self._vertex_numbers.before_first
        # Numbers of several publishers interleave: their gaps mean nothing.
        if missing > counted and self.publishers <= 1:
            self._count_missing(missing - counted, unreadable=counted > 0)
        if not self._vertex_limit.allows():
            self._drops.count(self._mesh, Reason.RATE, self._too_fast())
            return
        try:
            stamp = fields.stamp_to_ns(message.header.stamp)
            vertices = read(message, self._settings["max_vertices"])
        except InvalidMessageError as error:
            self._drops.count(self._mesh, error.reason, str(error))
            return
        frame = MeshFrame(stamp, vertices, version, step, message.header.frame_id, received)
        new_publisher, self._unnoticed = self._unnoticed, False
        self._hand_on(self._placement.take(frame, new_publisher))

    def _count_missing(self, missing: int, unreadable: bool) -> None:
        """unreadable: some of the same gap were, so that these are taken for unreadable too."""
        if unreadable:
            self._count_unreadable(missing)
            return
        self._drops.count(
            self._mesh,
            Reason.MIDDLEWARE,
            f"{missing} messages did not reach the node: they came faster than it reads (parameter input_depth) or "
            "could not be deserialised (see the log of DDS)",
            missing,
        )

    def _on_unreadable(self) -> None:
        self._unreadable += 1
        self._count_unreadable(1)

    def _count_unreadable(self, messages: int) -> None:
        self._metrics.frame_received(self._mesh, None, messages)
        self._drops.count(self._mesh, Reason.MALFORMED, f"{self._vertex_topic}: {_UNREADABLE}", messages)

    def _on_unreadable_topology(self) -> None:
        self._refused.count(self._mesh, Reason.MALFORMED, f"{self._subscriptions[0].topic_name}: {_UNREADABLE}")

    def _hand_on(self, frames: list[Ready]) -> None:
        for frame, new_publisher in frames:
            self._on_frames(self._assembler.add(self._mesh, frame, new_publisher))

    def _too_fast(self) -> str:
        return f"more than {self._settings['max_rate']:g} messages a second (parameter max_rate)"
