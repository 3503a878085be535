# SPDX-License-Identifier: Apache-2.0
"""Subscriptions to joint states: those that come go to their robots, and frames that waited for them go on.

The last ones are kept for robots that are not known yet: nothing orders a description and joint states.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rclpy.node import Node
from sensor_msgs.msg import JointState

from hpccd_ros.frames.drops import Input, Reason, Refusal
from hpccd_ros.frames.pipeline import FramePipeline
from hpccd_ros.frames.rate_limit import RateLimit
from hpccd_ros.middleware import joint_messages, qos, unreadable
from hpccd_ros.node.accounts import Accounts
from hpccd_ros.node.hand_over import hand_over
from hpccd_ros.node.input_subscription import InputSubscription, unheard
from hpccd_ros.node.mesh_topic import UNREADABLE
from hpccd_ros.params import robot_parameters
from hpccd_ros.params.table import ROBOT
from hpccd_ros.robots.joint_frames import JointFrames
from hpccd_ros.robots.joint_publishers import PublisherNumbers


@dataclass
class _Recent:
    """``sent``, ``publisher``: as in `joint_messages.fill`. ``refused``: its refusal is already counted."""

    message: JointState
    sent: int
    publisher: int | None
    refused: bool


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
        self._subscriptions = [self._subscribe(topic, robots) for topic, robots in topics.items()]

    def use(self, pipeline: FramePipeline, by_joints: Mapping[str, JointFrames]) -> None:
        self._pipeline, self._of_robots = pipeline, by_joints
        for topic, robots in robot_parameters.joint_topics(self._settings[ROBOT]).items():
            moved = [by_joints[robot] for robot in robots if robot in by_joints]
            for recent in self._recent[topic]:
                refusals = joint_messages.fill(moved, recent.message, topic, recent.sent, recent.publisher)
                if not recent.refused:
                    self._refuse(refusals)
                    recent.refused = bool(refusals)

    def close(self) -> None:
        for subscription in self._subscriptions:
            subscription.close()
        self._subscriptions.clear()

    def warnings(self) -> list[str]:
        """Topics without a publisher, and publishers that are not connected."""
        silent = [subscription.topic for subscription in self._subscriptions if not subscription.publishers]
        return [f"nobody publishes {topic}" for topic in silent] + unheard(self._subscriptions)

    def _subscribe(self, topic: str, robots: list[str]) -> InputSubscription:
        limit = RateLimit(self._settings["max_rate"])
        numbers = PublisherNumbers()

        def receive(message: JointState, info: dict[str, Any]) -> None:
            sent = info["source_timestamp"]
            self._accounts.on_heard("joint state", topic, info)
            publisher = numbers.of(info["publication_sequence_number"], several)
            if not limit.allows():
                text = f"more than max_rate = {self._settings['max_rate']:g} messages a second; some are dropped"
                self._refuse([Refusal(topic, Reason.RATE, text, what=Input.JOINT_STATE, sent=sent)])
                return
            self._accounts.inputs.add(topic, sent)
            moved = [self._of_robots[robot] for robot in robots if robot in self._of_robots]
            refusals = joint_messages.fill(moved, message, topic, sent, publisher)
            if (kept := joint_messages.kept(message)) is not None:
                self._recent[topic].append(_Recent(kept, sent, publisher, bool(refusals)))
            elif len(moved) < len(robots) and not refusals:
                refusals = [joint_messages.too_large(topic)]
            self._refuse(refusals)
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

        refusal = Refusal(topic, Reason.MALFORMED, f"{topic}: {UNREADABLE}", what=Input.JOINT_STATE)
        unreadable.watch(subscription.subscription, lambda: self._refuse([refusal]))
        return subscription

    def _refuse(self, refusals: list[Refusal]) -> None:
        for refusal in refusals:
            self._accounts.refused(refusal)
