# SPDX-License-Identifier: Apache-2.0
"""The robots of a configured node: from files at once, from topics when their description has arrived."""

import time
from collections.abc import Callable
from typing import Any

from std_msgs.msg import String

from hpccd_ros.base.quoting import shortened
from hpccd_ros.middleware import executors, graph, message_types, qos, robot_files
from hpccd_ros.node.input_subscription import InputSubscription, unconnected
from hpccd_ros.node.life_cycle import GuardedLifecycleNode
from hpccd_ros.params import robot_parameters
from hpccd_ros.params.table import ROBOT
from hpccd_ros.params.values import ParameterError
from hpccd_ros.robots.errors import RobotError, SemanticsError
from hpccd_ros.robots.robot import Robot

# s without parsing descriptions after some were parsed: parsing takes up to seconds, and any process may publish them.
PERIOD = 1.0
LOOK = 0.25  # s between two looks at those that came too soon
LONGEST = 500


class RobotDescriptions:
    """``robots``: name -> robot, for those that are known; a rejected description leaves the previous one in use.

    on_change: called when a robot has become known or has changed; on_doubt: when `doubts` has changed. Raises
    ParameterError for a file that cannot be used.
    """

    def __init__(
        self,
        node: GuardedLifecycleNode,
        settings: dict[str, Any],
        on_change: Callable[[], None],
        on_doubt: Callable[[], None] = lambda: None,
    ) -> None:
        self._node = node
        self._on_doubt = on_doubt
        self._values = settings[ROBOT]
        self._on_change = on_change
        self._semantics: dict[str, str | None] = {}
        self._texts: dict[str, str] = {}  # in use
        self._waiting: dict[str, str] = {}  # came too soon after the last
        self._rejected: dict[str, str] = {}  # why the last description was
        self._warned: dict[str, tuple[str, ...]] = {}  # of the last one that was not
        self._reading: list[str] = []
        self._read = -PERIOD  # when it ended
        self.robots: dict[str, Robot] = {}
        self._topics = robot_parameters.topics(settings[ROBOT])
        self._subscriptions: dict[str, InputSubscription] = {}
        for name in self._values:
            self._read_files(name)
        for name, topic in self._topics.items():
            self._listen(name, topic)
        if self._topics:
            node.configured_timer(LOOK, self._take_waiting)

    @property
    def complete(self) -> bool:
        return len(self.robots) == len(self._values)

    def doubts(self) -> dict[str, str]:
        """Robots with a newer description that is not in use, and why."""
        newer = dict.fromkeys([*self._reading, *self._waiting], "its new description is being read")
        return newer | {name: f"its description was rejected: {why}" for name, why in self._rejected.items()}

    def warnings(self) -> list[str]:
        """Robots that are not known, and publishers that are not connected."""
        waiting = [
            f"robot {name} waits for its description on {why}"
            for name, subscription in self._subscriptions.items()
            if name not in self.robots and name not in self._rejected and (why := self._why_silent(name, subscription))
        ]
        return waiting + unconnected(self._subscriptions.values())

    def rejected(self) -> list[str]:
        """Which descriptions cannot be used; the log has each as an error."""
        return [f"robot {name}: {why}" for name, why in self._rejected.items()]

    def _why_silent(self, name: str, subscription: InputSubscription) -> str:
        topic = subscription.topic
        if subscription.publishers:
            return subscription.why_silent(message_types.DESCRIPTION, once=True)
        parameter = f"{ROBOT}.{name}.description"
        return (
            f"{topic}, which has no publisher; start robot_state_publisher, or name its topic or a URDF file"
            f"{graph.near_topic(self._node, topic, message_types.DESCRIPTION, [parameter])}"
        )

    def _read_files(self, name: str) -> None:
        values, given = self._values[name], ""
        try:
            given = "srdf"
            self._semantics[name] = robot_files.text_of(values["srdf"]) if values["srdf"] else None
            if name in self._topics:
                return
            given = "description"
            text = robot_files.text_of(values["description"])
            self.robots[name] = self._made(name, text)
        except RobotError as error:
            given = "srdf" if isinstance(error, SemanticsError) else given
            raise ParameterError(f"{ROBOT}.{name}.{given}: {shortened(error, LONGEST)}") from error

    def _made(self, name: str, text: str) -> Robot:
        values = self._values[name]
        file = None if name in self._topics else values["description"]
        robot = robot_files.robot_of(name, values, text, self._semantics[name], robot_files.resolver(file))
        for warning in robot.warnings:
            if warning not in self._warned.get(name, ()):
                self._node.get_logger().warning(f"robot {name}: {shortened(warning, LONGEST)}")
        self._warned[name] = robot.warnings
        return robot

    def _listen(self, name: str, topic: str) -> None:
        subscription = self._subscriptions[name] = InputSubscription(
            self._node, String, topic, lambda message: self._receive(name, message.data), qos.DESCRIPTION
        )
        executors.watch_unreadable(subscription.subscription, lambda: self._reject(name, "it cannot be deserialised"))
        self._node.when_unconfigured(subscription.close)

    def _receive(self, name: str, text: str) -> None:
        if text == self._texts.get(name):
            self._waiting.pop(name, None)
            self._rejected.pop(name, None)
            self._on_doubt()
            return
        self._waiting[name] = text
        self._on_doubt()
        self._take_waiting()

    def _take_waiting(self) -> None:
        soon = time.monotonic() - self._read < PERIOD
        waiting = {name: text for name, text in self._waiting.items() if not (soon and self._was_read(name))}
        if not waiting:
            return
        self._waiting = {name: text for name, text in self._waiting.items() if name not in waiting}
        known = dict(self.robots)
        self._reading = list(waiting)
        try:
            for name, text in waiting.items():
                self._take(name, text)
            if self.robots != known:
                self._on_change()
        finally:
            self._reading = []
            self._on_doubt()
            self._read = time.monotonic()

    def _was_read(self, name: str) -> bool:
        """Whether the first description of the robot was parsed: the scene waits for it."""
        return name in self._texts or name in self._rejected

    def _take(self, name: str, text: str) -> None:
        try:
            self.robots[name] = self._made(name, text)
        except RobotError as error:
            self._reject(name, shortened(error, LONGEST))
            return
        self._texts[name] = text
        self._rejected.pop(name, None)

    def _reject(self, name: str, why: str) -> None:
        kept = "; the previous one stays in use" if name in self.robots else ""
        self._rejected[name] = f"{why}{kept}"
        self._node.get_logger().error(f"robot {name}: {self._rejected[name]}")
        self._on_doubt()
