# SPDX-License-Identifier: Apache-2.0
"""A subscription of the node, warnings about publishers with incompatible QoS, and the hand-over of frames to the
detection thread."""

import time
from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from hpccd_ros.base.quoting import counted
from hpccd_ros.frames.pipeline import FramePipeline
from hpccd_ros.frames.types import Outcome
from hpccd_ros.middleware import graph, qos_overrides
from hpccd_ros.node.accounts import Accounts
from hpccd_ros.node.silence import QUIET

# Bounds the publishers reported for one topic at a time: any process may start some.
MOST_REPORTED = 3


class InputSubscription:
    """Subscribed from construction until ``close``.

    reliability: the parameter that sets it for this topic; "": only ``qos_overrides`` do. counts: receives
    qos_incompatible.TOPIC. events: message_lost and matched, as in SubscriptionEventCallbacks.
    """

    def __init__(
        self,
        node: Node,
        message: type,
        topic: str,
        callback: Callable,
        profile: QoSProfile,
        *,
        reliability: str = "",
        counts: Counter | None = None,
        events: dict[str, Callable[[Any], None]] | None = None,
        raw: bool = False,
    ) -> None:
        self._node = node
        self._reliability = reliability
        self._any_unconnected = False

        def incompatible(event: Any) -> None:
            if counts is not None:
                counts[f"qos_incompatible.{topic}"] += event.total_count_change
            self._any_unconnected = True

        self.subscription = qos_overrides.create_subscription(
            node,
            message,
            topic,
            callback,
            profile,
            event_callbacks=SubscriptionEventCallbacks(incompatible_qos=incompatible, **(events or {})),
            raw=raw,
        )

    @property
    def topic(self) -> str:
        """Its full name."""
        return self.subscription.topic_name

    @property
    def publishers(self) -> int:
        """Known publishers of the topic."""
        return self._node.count_publishers(self.topic)

    def close(self) -> None:
        self._node.destroy_subscription(self.subscription)

    def warnings(self) -> list[str]:
        """One sentence for each publisher that exists and is not connected."""
        if not self._any_unconnected:  # asking for the publishers of every topic would take long
            return []
        found = self._node.get_publishers_info_by_topic(self.topic)
        lines = [line for publisher in found if (line := self._why_unconnected(publisher))]
        self._any_unconnected = bool(lines)
        lines = list(dict.fromkeys(lines))
        more = len(lines) - MOST_REPORTED
        return [
            *lines[:MOST_REPORTED],
            *([f"{self.topic}: {counted(more, 'more such publisher')}"] if more > 0 else []),
        ]

    def why_silent(self, type_name: str, once: bool = False) -> str:
        """Why no message comes, in words, and the remedy; "": `warnings` says it. type_name: of its messages. once: one
        message is enough, and none came so far."""
        found = self._node.get_publishers_info_by_topic(self.topic)
        if not found:
            return f"{self.topic}: it has no publisher; start one, or let it publish on this topic"
        of_type = [publisher for publisher in found if publisher.topic_type == type_name]
        if not of_type:
            return (
                f"{self.topic}: a publisher {graph.endpoint_node(found[0])} sends {found[0].topic_type}, and the node "
                f"expects {type_name}; publish this type, or use another topic"
            )
        if all(self._why_unconnected(publisher) for publisher in of_type):
            return ""
        publisher = f"from its publisher {graph.endpoint_node(of_type[0])}"
        if not once:
            return f"{self.topic}: no message for {QUIET:g} s {publisher}; check that it still publishes"
        kept = self.subscription.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
        remedy = "once is enough" if kept else "messages sent before the node subscribed are not received"
        return f"{self.topic}: no message so far {publisher}; publish it{'' if kept else ' again'}: {remedy}"

    def _why_unconnected(self, publisher: Any) -> str:
        """Why a publisher is not connected, and the remedy; "": it is."""
        offered, asked = publisher.qos_profile, self.subscription.qos_profile
        less = []
        if (offered.reliability, asked.reliability) == (ReliabilityPolicy.BEST_EFFORT, ReliabilityPolicy.RELIABLE):
            less.append(("best_effort", "reliable"))
        if (offered.durability, asked.durability) == (DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL):
            less.append(("volatile", "transient_local"))
        if not less:
            return ""
        offers, asks = (" and ".join(words) for words in zip(*less, strict=True))
        remedy = f"let the publisher offer {asks}"
        if less == [("best_effort", "reliable")]:
            remedy = f"set {self._setting()}: best_effort, or {remedy}"
        elif len(less) == 1:
            remedy += " (latched): otherwise messages sent before the node listened would be missing"
        return (
            f"{self.topic}: a publisher {graph.endpoint_node(publisher)} offers {offers} but the node requests {asks}, "
            f"so none of its messages are received; {remedy}"
        )

    def _setting(self) -> str:
        override = qos_overrides.reliability_parameter(self.topic)
        return self._reliability if self._reliability and not self._node.has_parameter(override) else override


def unconnected(subscriptions: Iterable[InputSubscription]) -> list[str]:
    """The warnings of all subscriptions, each once."""
    return list(dict.fromkeys(line for subscription in subscriptions for line in subscription.warnings()))


_YIELD = 2e-5  # s; what counts is that it is not 0


def hand_over(outcome: Outcome, pipeline: FramePipeline, accounts: Accounts) -> None:
    """Count the outcome of a message; then let the detection thread run if there is a frame for it.

    In this order: the result of a frame states how many were dropped before it.
    """
    accounts.add(outcome)
    for frame in outcome.frames:
        for rejection in pipeline.enqueue(frame.after_inputs(accounts.inputs.count)):
            accounts.rejected(rejection)
    if outcome.frames:
        # Lets the detection thread have the interpreter at once, not when the executor is back in its wait: the
        # hand-over takes 0.03 instead of 0.35 ms. Before the next outcome, whose frame may push this one out.
        time.sleep(_YIELD)
