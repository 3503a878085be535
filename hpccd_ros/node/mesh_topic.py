# SPDX-License-Identifier: Apache-2.0
"""One topic of one mesh: its subscription, and what the middleware tells of it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from hpccd_ros.frames.drops import Aspect, Input, Reason, Refusal
from hpccd_ros.frames.pipeline import FramePipeline
from hpccd_ros.frames.rate_limit import RateLimit
from hpccd_ros.frames.sequence import SequenceWatch
from hpccd_ros.frames.taken_inputs import NEW_PUBLISHER, SEVERAL_PUBLISHERS
from hpccd_ros.middleware import mesh_inputs, topic_names
from hpccd_ros.node.accounts import Accounts
from hpccd_ros.node.input_subscription import InputSubscription

UNREADABLE = "a message cannot be deserialised; build its publisher with the same definition of the message"


@dataclass(eq=False)
class Reception:
    """What all topics of a mesh have in common: who listens, and where messages go, which may change."""

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
        self.sent = 0  # when the last message taken was sent
        self._limit = RateLimit(reception.settings["max_rate"])
        self._subscription: InputSubscription | None = None
        self._topic = topic_names.of_mesh(reception.mesh, kind)

    def taken(self, sent: int, new_publisher: bool, several: bool = False) -> None:
        """A message goes to the pipeline; sent: source timestamp, ns. several: the topic has several publishers."""
        flags = NEW_PUBLISHER * new_publisher + SEVERAL_PUBLISHERS * several
        self.reception.accounts.inputs.add(self._topic, sent, flags)

    def subscribe(self, callback: Callable[[Any, dict[str, Any]], None], profile: QoSProfile) -> Subscription:
        topic = self._topic
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
        if self._subscription is not None:
            self._subscription.close()
            self._subscription = None

    def take(self, info: dict[str, Any]) -> None:
        """A message has been received, and its info."""
        self.sent = info["source_timestamp"]
        self.reception.accounts.on_heard(self.kind, self.reception.mesh, info)

    @property
    def name(self) -> str:
        """Of the topic, in full."""
        return self._subscription.topic

    @property
    def publishers(self) -> int:
        """As far as is known."""
        return self._subscription.publishers

    def warnings(self) -> list[str]:
        """Publishers that are not connected."""
        return self._subscription.warnings() if self._subscription is not None else []

    def too_fast(self) -> str | None:
        """In words, where a message came faster than the node looks at them."""
        if self._limit.allows():
            return None
        return f"more than {self.reception.settings['max_rate']:g} messages a second (parameter max_rate)"

    def refuse(self, reason: Reason, text: str, messages: int = 1) -> None:
        """Refuse the message taken last, or messages before it."""
        self._refuse(reason, text, messages, self.sent)

    def refuse_unreadable(self) -> None:
        """Refuse a message that cannot be deserialised, so that the time at which it was sent is unknown."""
        self._refuse(Reason.MALFORMED, f"{self.name}: {UNREADABLE}", 1, None)

    def _refuse(self, reason: Reason, text: str, messages: int, sent: int | None) -> None:
        self.reception.accounts.refused(
            Refusal(self.reception.mesh, reason, text, messages, what=self.what, aspect=self.aspect, sent=sent)
        )

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
