# SPDX-License-Identifier: Apache-2.0
"""Subscriptions to joint states and transforms: they go to their robots and into the pipeline, and frames that waited
for them go on.

The last joint states are kept for robots that are not known yet: nothing orders a description and joint states.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rclpy.node import Node
from sensor_msgs.msg import JointState

from hpccd_ros.base.clocks import Clocks
from hpccd_ros.base.quoting import counted
from hpccd_ros.frames.arrivals import InterleavedSequences, RateLimit
from hpccd_ros.frames.drops import Input, Reason, Rejection
from hpccd_ros.frames.pipeline import FramePipeline
from hpccd_ros.middleware import executors, graph, joint_messages, message_types, qos, topic_names, transform_topics
from hpccd_ros.middleware.message_types import message_class
from hpccd_ros.middleware.transform_topics import TransformTopic
from hpccd_ros.node.accounts import Accounts
from hpccd_ros.node.input_subscription import InputSubscription, hand_over, unconnected
from hpccd_ros.node.joint_state_watch import JointStateWatch
from hpccd_ros.node.mesh_subscriptions import UNREADABLE
from hpccd_ros.params import robot_parameters
from hpccd_ros.params.table import ROBOT
from hpccd_ros.robots.joint_frames import JointFrames
from hpccd_ros.robots.joint_publishers import PublisherNumbers


@dataclass
class _Recent:
    """``sent``, ``publisher``: as in `joint_messages.fill`. ``rejected``: its rejection is already counted."""

    message: JointState
    sent: int
    publisher: int | None
    rejected: bool


class JointSubscriptions:
    """Subscribed from construction until ``close``. of_robots: robot -> what its joint states move."""

    def __init__(
        self,
        node: Node,
        settings: dict[str, Any],
        pipeline: FramePipeline,
        of_robots: Mapping[str, JointFrames],
        accounts: Accounts,
    ) -> None:
        self._node = node
        self._settings = settings
        self._pipeline = pipeline
        self._of_robots = of_robots
        self._accounts = accounts
        topics = robot_parameters.joint_topics(settings[ROBOT])
        self._recent: dict[str, deque[_Recent]] = {topic: deque(maxlen=joint_messages.MOST_RECENT) for topic in topics}
        self._watches = {topic: JointStateWatch(node.resolve_topic_name(topic)) for topic in topics}
        self._watch(topics)
        self._subscriptions = [self._subscribe(topic, robots) for topic, robots in topics.items()]

    def use(self, pipeline: FramePipeline, by_joints: Mapping[str, JointFrames]) -> None:
        self._pipeline, self._of_robots = pipeline, by_joints
        self._watch(robot_parameters.joint_topics(self._settings[ROBOT]))
        for topic, robots in robot_parameters.joint_topics(self._settings[ROBOT]).items():
            moved = [by_joints[robot] for robot in robots if robot in by_joints]
            for recent in self._recent[topic]:
                rejections = joint_messages.fill(moved, recent.message, topic, recent.sent, recent.publisher)
                if not recent.rejected:
                    self._reject(rejections)
                    recent.rejected = bool(rejections)

    def close(self) -> None:
        for subscription in self._subscriptions:
            subscription.close()
        self._subscriptions.clear()

    def warnings(self) -> list[str]:
        """Topics without a publisher, publishers that are not connected, and joint states that move nothing."""
        robots = robot_parameters.joint_topics(self._settings[ROBOT]).values()
        silent = {
            subscription.topic: [f"{ROBOT}.{robot}.joint_states" for robot in moved]
            for moved, subscription in zip(robots, self._subscriptions, strict=True)
            if not subscription.publishers
        }
        lines = [
            f"{topic}: it has no publisher; start one, or let it publish on this topic"
            f"{graph.near_topic(self._node, topic, message_types.JOINT_STATES, parameters)}"
            for topic, parameters in silent.items()
        ]
        lines += [line for watch in self._watches.values() for line in watch.warnings()]
        return lines + unconnected(self._subscriptions)

    def silent(self) -> list[str]:
        """Topics whose publishers have stopped."""
        return [
            why
            for topic, subscription in zip(self._watches, self._subscriptions, strict=True)
            if (count := subscription.publishers) and self._watches[topic].silent(count)
            if (why := subscription.why_silent(message_types.JOINT_STATES))
        ]

    def _watch(self, topics: Mapping[str, list[str]]) -> None:
        for topic, robots in topics.items():
            self._watches[topic].use([self._of_robots[robot].joints for robot in robots if robot in self._of_robots])

    def _subscribe(self, topic: str, robots: list[str]) -> InputSubscription:
        limit = RateLimit(self._settings["max_rate"])
        numbers = PublisherNumbers()

        def receive(message: JointState, info: dict[str, Any]) -> None:
            sent = info["source_timestamp"]
            self._accounts.on_received("joint state", topic, info)
            publisher = numbers.of(info["publication_sequence_number"], several)
            if not limit.allows():
                text = f"more than max_rate = {self._settings['max_rate']:g} messages a second; some are dropped"
                self._reject([Rejection(topic, Reason.RATE, text, what=Input.JOINT_STATE, sent=sent)])
                return
            self._accounts.inputs.add(topic, sent)
            stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            self._accounts.metrics.stamped(topic, stamp)
            self._watches[topic].receive(stamp, message.name, message.position)
            moved = [self._of_robots[robot] for robot in robots if robot in self._of_robots]
            rejections = joint_messages.fill(moved, message, topic, sent, publisher)
            if (kept := joint_messages.kept(message)) is not None:
                self._recent[topic].append(_Recent(kept, sent, publisher, bool(rejections)))
            elif len(moved) < len(robots) and not rejections:
                rejections = [joint_messages.too_large(topic)]
            self._reject(rejections)
            for outcome in self._pipeline.retry():
                hand_over(outcome, self._pipeline, self._accounts)

        profile = qos.joint_states(self._settings["input_reliability"])
        subscription = InputSubscription(
            self._node,
            JointState,
            topic,
            receive,
            profile,
            reliability="input_reliability",
            counts=self._accounts.connections,
        )

        def several() -> bool:
            return subscription.subscription.get_publisher_count() > 1

        rejection = Rejection(topic, Reason.MALFORMED, f"{topic}: {UNREADABLE}", what=Input.JOINT_STATE)
        executors.watch_unreadable(subscription.subscription, lambda: self._reject([rejection]))
        return subscription

    def _reject(self, rejections: list[Rejection]) -> None:
        for rejection in rejections:
            self._accounts.rejected(rejection)


class TransformSubscriptions:
    """Subscribed from construction until ``close``.

    max_rate: most messages a second that are looked at of each topic.
    """

    def __init__(self, node: Node, pipeline: FramePipeline, accounts: Accounts, max_rate: float) -> None:
        self._node = node
        self._pipeline = pipeline
        self._accounts = accounts
        self._max_rate = max_rate
        understood = transform_topics.understood()
        received = pipeline.transforms.received
        for topic in transform_topics.ALL.values():
            received[self._name(topic)] = 0 if topic in understood else self._not_understood(topic)
        self._subscriptions = [self._subscribe(topic) for topic in understood]

    def use(self, pipeline: FramePipeline, by_joints: object) -> None:
        self._pipeline = pipeline

    def close(self) -> None:
        for subscription in self._subscriptions:
            subscription.close()
        self._subscriptions.clear()

    def warnings(self) -> list[str]:
        """Publishers that are not connected; frames that wait for transforms are reported elsewhere."""
        return unconnected(self._subscriptions)

    def silent(self) -> list[str]:
        """None: frames that wait for transforms are reported elsewhere."""
        return []

    def _subscribe(self, topic: TransformTopic) -> InputSubscription:
        limit = RateLimit(self._max_rate)
        name, received = self._name(topic), self._pipeline.transforms.received
        numbers = InterleavedSequences()
        unreadable_since = 0  # since the last message read

        def missing(number: int) -> int:
            """Static transforms lost before this message, without those known to be unreadable."""
            nonlocal unreadable_since
            alone, known = subscription.publishers <= 1, unreadable_since
            gap = numbers.missing(number, alone)
            unreadable_since = 0
            # With several publishers a gap may be one between two of them.
            return gap - known if topic.static and gap > known and alone else 0

        def on_unreadable() -> None:
            nonlocal unreadable_since
            unreadable_since += 1
            self._unread(Rejection(topic.name, Reason.MALFORMED, f"{name}: {UNREADABLE}", what=Input.TRANSFORM), topic)

        def matched(event: Any) -> None:
            new = event.total_count_change
            numbers.matched(new, new - event.current_count_change)

        def receive(message: Any, info: dict[str, Any]) -> None:
            received[name] += 1
            sent = info["source_timestamp"]
            self._accounts.on_received("message", name, info)
            lost = missing(info["publication_sequence_number"])
            if not limit.allows():
                text = f"more than max_rate = {self._max_rate:g} messages a second; some are dropped"
                self._unread(Rejection(topic.name, Reason.RATE, text, what=Input.TRANSFORM, sent=sent), topic)
                return
            self._accounts.inputs.add(topic.name, sent)
            if lost > 0:
                text = f"{name}: lost, or not to be deserialised: {counted(lost, 'message')}; send them again"
                rejection = Rejection(topic.name, Reason.MIDDLEWARE, text, lost, what=Input.TRANSFORM, sent=sent - 1)
                self._unread(rejection, topic)
            for rejection in transform_topics.fill(self._pipeline.transforms, message, topic, sent):
                self._accounts.rejected(rejection)
            for outcome in self._pipeline.retry():
                hand_over(outcome, self._pipeline, self._accounts)

        profile = qos.TRANSFORMS_STATIC if topic.static else qos.TRANSFORMS
        message = message_class(topic.type_name)
        counts = self._accounts.connections
        subscription = InputSubscription(
            self._node, message, topic.name, receive, profile, counts=counts, events={"matched": matched}
        )
        executors.watch_unreadable(subscription.subscription, on_unreadable)
        return subscription

    def _unread(self, rejection: Rejection, topic: TransformTopic) -> None:
        """Reject a message whose transforms are unknown."""
        sent = rejection.sent or Clocks().system()
        self._pipeline.transforms.rejected(None, topic.static, sent)
        self._accounts.rejected(rejection)

    def _not_understood(self, topic: TransformTopic) -> str:
        package = topic.type_name.partition("/")[0]
        stamped = transform_topics.ALL[topic_names.TRANSFORMS_STATIC if topic.static else topic_names.TRANSFORMS]
        return (
            f"not understood ({package} is not installed; {stamped.type_name.replace('/msg/', '/')} on "
            f"{self._name(stamped)} works without it)"
        )

    def _name(self, topic: TransformTopic) -> str:
        return self._node.resolve_topic_name(topic.name)
