# SPDX-License-Identifier: Apache-2.0
"""Parameters qos_overrides.TOPIC.publisher|subscription.POLICY: the user's QoS of a topic.

TOPIC is the full name, with namespace and remapping. Only given policies are declared: others keep their default;
that of vertices follows input_reliability and input_depth, which may change while the node is unconfigured.
"""

import copy
from collections.abc import Callable, Iterable
from typing import Any

from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.subscription import Subscription

from hpccd_ros.base.quoting import not_one_of, shortened
from hpccd_ros.middleware import topic_names

PREFIX = "qos_overrides."
# A larger history would hold more messages than fit into memory.
DEEPEST = 100_000
_CHOICES = {"history": ("keep_last", "keep_all"), "reliability": ("reliable", "best_effort")}
_POLICIES = {"history": QoSPolicyKind.HISTORY, "depth": QoSPolicyKind.DEPTH, "reliability": QoSPolicyKind.RELIABILITY}


def create_publisher(node: Node, message: type, topic: str, profile: QoSProfile) -> Publisher:
    """As that of ``node``, with what the parameters say in place of what ``profile`` says."""
    # A copy: rclpy writes the overrides into the profile that it gets.
    return node.create_publisher(
        message, topic, copy.copy(profile), qos_overriding_options=_options(node, "publisher", topic)
    )


def create_subscription(
    node: Node, message: type, topic: str, callback: Callable, profile: QoSProfile, **options: Any
) -> Subscription:
    """As that of ``node``, with what the parameters say in place of what ``profile`` says."""
    overriding = _options(node, "subscription", topic)
    return node.create_subscription(
        message, topic, callback, copy.copy(profile), qos_overriding_options=overriding, **options
    )


def reliability(node: Node, entity: str, topic: str, default: ReliabilityPolicy) -> ReliabilityPolicy:
    """The node's reliability on ``topic`` (resolved name). entity: "publisher" or "subscription"."""
    given = _given(node).get(_name(entity, topic, "reliability"))
    return default if given is None else ReliabilityPolicy[given.value.upper()]


def reliability_parameter(topic: str) -> str:
    """The parameter that sets the reliability of a subscription to ``topic`` (resolved name)."""
    return _name("subscription", topic, "reliability")


def unusable_override(node: Node) -> str | None:
    """Why an override cannot be used, or None; one of no topic of the node is unknown: see `known`."""
    for name, parameter in _given(node).items():
        policy, value = name.rpartition(".")[2], parameter.value
        if policy == "depth" and not (type(value) is int and 1 <= value <= DEEPEST):
            return f"{shortened(name)}: {shortened(value)} is not valid; use a whole number of 1 .. {DEEPEST:,}"
        if policy in _CHOICES and value not in _CHOICES[policy]:
            return f"{shortened(name)}: {not_one_of(value, _CHOICES[policy])}"
    return None


def known(node: Node, subscribed: Iterable[str]) -> set[str]:
    """The names of all overrides that have an effect here. subscribed: names of all topics that may be."""
    topics = [("publisher", topic) for topic in topic_names.PUBLISHED]
    topics += [("subscription", topic) for topic in subscribed]
    return {_name(entity, node.resolve_topic_name(topic), policy) for entity, topic in topics for policy in _POLICIES}


def _options(node: Node, entity: str, topic: str) -> QoSOverridingOptions:
    given, resolved = _given(node), node.resolve_topic_name(topic)
    kinds = [kind for policy, kind in _POLICIES.items() if _name(entity, resolved, policy) in given]
    return QoSOverridingOptions(kinds)


def _given(node: Node) -> dict[str, Parameter]:
    overrides = getattr(node, "_parameter_overrides", {})  # rclpy has no public list of given parameters
    return {name: parameter for name, parameter in overrides.items() if name.startswith(PREFIX)}


def _name(entity: str, topic: str, policy: str) -> str:
    return f"{PREFIX}{topic}.{entity}.{policy}"
