# SPDX-License-Identifier: Apache-2.0
"""Subscriptions to one mesh: its topology, and where it is."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from hpccd.msg import MeshTopology
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from hpccd_ros.base.quoting import counted, shortened
from hpccd_ros.detect.core import unusable_topology
from hpccd_ros.frames.arrivals import RateLimit, SequenceWatch
from hpccd_ros.frames.drops import Aspect, Input, Reason, Rejection
from hpccd_ros.frames.pipeline import FramePipeline
from hpccd_ros.frames.taken_inputs import NEW_PUBLISHER, SEVERAL_PUBLISHERS
from hpccd_ros.frames.types import MeshFrame, PoseFrame, Topology
from hpccd_ros.frames.welding import Welding
from hpccd_ros.middleware import executors, mesh_inputs, qos, topic_names
from hpccd_ros.middleware.fields import InvalidMessageError
from hpccd_ros.node.accounts import Accounts
from hpccd_ros.node.input_subscription import InputSubscription, hand_over
from hpccd_ros.node.silence import Silence

UNREADABLE = "a message cannot be deserialised; build its publisher with the same definition of the message"


@dataclass(eq=False)
class Reception:
    """Common data of all topics of a mesh: the node, and the receivers of messages, which may change."""

    node: Node
    mesh: str
    settings: dict[str, Any]
    pipeline: FramePipeline
    accounts: Accounts


class MeshTopic:
    """kind: the last part of the topic's name, one of mesh_inputs.TYPES."""

    def __init__(self, reception: Reception, kind: str) -> None:
        self.reception = reception
        self.kind = kind
        self.numbers = SequenceWatch()
        self.received = 0  # messages
        self.sent = 0  # when the last message taken was sent
        self.rejected = ""  # why the last message was; "": it was not
        self._silence = Silence()
        self._limit = RateLimit(reception.settings["max_rate"])
        self._subscription: InputSubscription | None = None
        self.relative_name = topic_names.of_mesh(reception.mesh, kind)

    def taken(self, sent: int, new_publisher: bool, several: bool = False) -> None:
        """A message goes to the pipeline; sent: source timestamp, ns. several: the topic has several publishers."""
        self.rejected = ""
        flags = NEW_PUBLISHER * new_publisher + SEVERAL_PUBLISHERS * several
        self.reception.accounts.inputs.add(self.relative_name, sent, flags)

    def subscribe(self, callback: Callable[[Any, dict[str, Any]], None], profile: QoSProfile) -> Subscription:
        topic = self.relative_name
        self._subscription = InputSubscription(
            self.reception.node,
            mesh_inputs.TYPES[self.kind],
            topic,
            callback,
            profile,
            reliability="" if self.kind == topic_names.TOPOLOGY else "input_reliability",
            counts=self.reception.accounts.connections,
            events=self._events(topic),
            raw=self.kind in topic_names.WHOLE,
        )
        return self._subscription.subscription

    def close(self) -> None:
        if self.received:
            self.reception.accounts.heard.add(self.relative_name)
        if self._subscription is not None:
            self._subscription.close()
            self._subscription = None

    def take(self, info: dict[str, Any]) -> None:
        """A message has been received, and its info."""
        self.received += 1
        self.sent = info["source_timestamp"]
        self.reception.accounts.on_received(self.kind, self.reception.mesh, info)

    @property
    def name(self) -> str:
        """Full name of the topic."""
        return self._subscription.topic

    @property
    def publishers(self) -> int:
        """As far as is known."""
        return self._subscription.publishers

    def warnings(self) -> list[str]:
        """Publishers that are not connected."""
        return self._subscription.warnings() if self._subscription is not None else []

    def silent(self, once: bool) -> list[str]:
        """Why nothing comes, where that has lasted. once: as in `why_silent`."""
        # A publisher has its time from when it is found on.
        if self._subscription is None or not self._silence.lasts((self.received, self.publishers)):
            return []
        why = self._subscription.why_silent(mesh_inputs.TYPE_NAMES[self.kind], once)
        return [why] if why else []

    def too_fast(self) -> str | None:
        """In words, where a message came faster than the node looks at them."""
        if self._limit.allows():
            return None
        return f"more than {self.reception.settings['max_rate']:g} messages a second (parameter max_rate)"

    def reject(self, reason: Reason, text: str, messages: int = 1) -> None:
        """Reject the message taken last, or messages before it."""
        self._reject(reason, text, messages, self.sent)

    def reject_unreadable(self) -> None:
        """Reject a message that cannot be deserialised, so that the time at which it was sent is unknown."""
        self._reject(Reason.MALFORMED, f"{self.name}: {UNREADABLE}", 1, None)

    def push(self, message: Topology | MeshFrame | PoseFrame, new_publisher: bool) -> None:
        """Push what the last message contains into the pipeline."""
        of = self.reception
        outcome = of.pipeline.push(of.mesh, message, new_publisher)
        for rejection in outcome.rejections:
            if (rejection.mesh, rejection.what, rejection.sent) == (of.mesh, self.what, self.sent):
                self.keep_rejected(rejection)
        hand_over(outcome, of.pipeline, of.accounts)

    def keep_rejected(self, rejection: Rejection) -> None:
        """The last message was rejected."""
        self.rejected = f"{rejection.reason}: {shortened(rejection.text)}"

    def _reject(self, reason: Reason, text: str, messages: int, sent: int | None) -> None:
        rejection = Rejection(
            self.reception.mesh, reason, text, messages, what=self.what, aspect=self.aspect, sent=sent
        )
        self.keep_rejected(rejection)
        self.reception.accounts.rejected(rejection)

    @property
    def what(self) -> Input:
        return mesh_inputs.INPUTS[self.kind]

    @property
    def aspect(self) -> Aspect:
        """The property of the mesh that its messages are about."""
        if self.what is Input.TOPOLOGY:
            return Aspect.TOPOLOGY
        of_shape = self.kind != topic_names.POSE and self.reception.pipeline.moves_by_poses(self.reception.mesh)
        return Aspect.SHAPE if of_shape else Aspect.PLACE

    def _events(self, topic: str) -> dict[str, Callable[[Any], None]]:
        """Count what the middleware reports of the subscription."""
        connections = self.reception.accounts.connections

        def lost(event: Any) -> None:
            connections[f"message_lost.{topic}"] += event.total_count_change

        def matched(event: Any) -> None:
            self.numbers.matched(event.total_count, event.total_count_change)

        return {"message_lost": lost, "matched": matched}


class TopologySubscription(MeshTopic):
    def __init__(self, reception: Reception) -> None:
        super().__init__(reception, topic_names.TOPOLOGY)
        executors.watch_unreadable(self.subscribe(self.receive, qos.TOPOLOGY_INPUT), self.reject_unreadable)

    def receive(self, message: MeshTopology, info: dict[str, Any]) -> None:
        of = self.reception
        self.take(info)
        _, new_publisher = self.numbers.next(info["publication_sequence_number"])
        if why := self.too_fast():
            self.reject(Reason.RATE, why)
            return
        try:
            topology = mesh_inputs.read(self.kind, message, of.settings, sent=info["source_timestamp"])
        except InvalidMessageError as error:
            self.reject(error.reason, str(error))
            return
        if why := unusable_topology(topology, of.mesh, of.mesh in of.settings["points"]):
            self.reject(Reason.BAD_TOPOLOGY, why)
            return
        self.taken(info["source_timestamp"], new_publisher)
        self.push(topology, new_publisher)

    def keep_rejected(self, rejection: Rejection) -> None:
        super().keep_rejected(rejection)
        self.reception.pipeline.topology_rejected(self.reception.mesh, self.rejected)


class PositionsSubscription(MeshTopic):
    """kind: one of topic_names.POSITIONS."""

    def __init__(self, reception: Reception, kind: str) -> None:
        super().__init__(reception, kind)
        self._welding = Welding()
        self._unreadable = 0  # messages counted as such since the last that was read
        settings = reception.settings
        profile = qos.vertices(settings["input_reliability"], settings["input_depth"])
        executors.watch_unreadable(self.subscribe(self.receive, profile), self._on_unreadable)

    def receive(self, message: Any, info: dict[str, Any]) -> None:
        received, of = time.monotonic(), self.reception
        self.take(info)
        self._count_received(info)
        if why := self.too_fast():
            self.reject(Reason.RATE, why)
            return
        # Asked only where it can matter, as it takes 4 us: of a frame in another frame_id, which may be a restart.
        here = hasattr(message, "header") and message.header.frame_id == of.pipeline.coordinate_frame[0]
        alone = here or self.publishers <= 1
        sent = info["source_timestamp"]
        try:
            frame = mesh_inputs.read(self.kind, message, of.settings, received, alone, sent=sent, welding=self._welding)
        except InvalidMessageError as error:
            self.taken(sent, False)  # listed, because a replay reads and rejects it too
            self.reject(error.reason, str(error))
            return
        of.accounts.metrics.stamped(of.mesh, frame.stamp)
        new_publisher = self.numbers.notice()
        self.taken(sent, new_publisher, not alone)
        self.push(frame, new_publisher)

    def _count_received(self, info: dict[str, Any]) -> None:
        of = self.reception
        transport = (info["received_timestamp"] - info["source_timestamp"]) * 1e-6
        of.accounts.metrics.frame_received(of.mesh, transport if transport >= 0 else None)
        missing, _ = self.numbers.next(info["publication_sequence_number"])
        unreadable, self._unreadable = self._unreadable, 0
        of.accounts.connections[f"before_first.{of.mesh}"] = self.numbers.before_first
        # Numbers of several publishers interleave: their gaps mean nothing.
        if missing <= unreadable or self.publishers > 1:
            return
        missing -= unreadable
        if unreadable:  # some of the same gap were, so that these are taken for unreadable too
            of.accounts.metrics.frame_received(of.mesh, None, missing)
            self.reject(Reason.MALFORMED, f"{self.name}: {UNREADABLE}", missing)
            return
        text = (
            f"{counted(missing, 'message')} did not reach the node: sent faster than it reads (parameter input_depth), "
            "or not to be deserialised (see the log of DDS)"
        )
        self.reject(Reason.MIDDLEWARE, text, missing)

    def _on_unreadable(self) -> None:
        self._unreadable += 1
        self.reception.accounts.metrics.frame_received(self.reception.mesh, None, 1)
        self.reject_unreadable()


class MeshSubscriptions:
    """Subscribed from construction until ``close``. values: parameters mesh.NAME.*."""

    def __init__(self, reception: Reception, values: Mapping[str, Any]) -> None:
        given_as = values["input"]
        self._reception = reception
        self._by_file = bool(values["file"])
        # Kinds of which one message is enough; the topology comes with each message of a whole mesh.
        self._whole = topic_names.is_whole(given_as, reception.mesh in reception.settings["points"])
        self._once = set() if self._whole else {topic_names.TOPOLOGY}
        if given_as in (topic_names.POSE, topic_names.BY_TRANSFORMS):
            self._once.add(topic_names.VERTICES)
        elif values["static"]:
            self._once.add(given_as)
        self.topics: list[MeshTopic] = []
        self.topics.append(TopologySubscription(reception))
        self._positions = [PositionsSubscription(reception, kind) for kind in topic_names.positions(given_as)]
        self.topics += self._positions

    def use(self, pipeline: FramePipeline, by_joints: object) -> None:
        self._reception.pipeline = pipeline

    def close(self) -> None:
        for topic in self.topics:
            topic.close()
        self.topics.clear()

    def silent(self) -> list[str]:
        """Why messages that are needed do not come."""
        return [line for topic in self.topics if self._needs(topic) for line in topic.silent(topic.kind in self._once)]

    def rejected(self) -> list[str]:
        """Messages that are sent once and were rejected."""
        return [
            f"{topic.name}: the last message was rejected ({topic.rejected}); publish a valid one"
            for topic in self.topics
            if topic.rejected and topic.kind in self._once
        ]

    def _needs(self, topic: MeshTopic) -> bool:
        """Whether a message must come: the next one, or the only one."""
        of = self._reception
        if topic.kind == topic_names.TOPOLOGY:
            return not (self._whole or topic.received or of.pipeline.topology(of.mesh))
        if topic.kind not in self._once:
            return True
        return not (self._by_file or topic.received or topic.relative_name in of.accounts.heard)

    def warnings(self) -> list[str]:
        """Warnings about the publishers of the mesh."""
        found = [(topic.publishers, topic.name) for topic in self._positions]
        several = [f"{publishers} publishers on {name}" for publishers, name in found if publishers > 1]
        unconnected = [line for topic in self.topics for line in topic.warnings()]
        return unconnected + several + self._reception.pipeline.awaited_transform(self._reception.mesh)
