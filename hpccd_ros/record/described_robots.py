# SPDX-License-Identifier: Apache-2.0
"""Robots whose description comes on a topic: which mesh files they need is known only then."""

from collections.abc import Callable

from rclpy.node import Node
from std_msgs.msg import String

from hpccd_ros.bag.writer import BagWriter
from hpccd_ros.middleware import qos
from hpccd_ros.params import robot_parameters
from hpccd_ros.record import attachments


class DescribedRobots:
    """Attaches to ``bag`` what the descriptions that `node` hears name. parameters: of the recorded node. resolve:
    relative -> absolute topic name. warn: takes what could not be read."""

    def __init__(
        self,
        node: Node,
        bag: BagWriter,
        parameters: dict,
        resolve: Callable[[str], str],
        warn: Callable[[str], object],
    ) -> None:
        self._bag = bag
        self._warn = warn
        self._told: set[str] = set()
        for robot, values in robot_parameters.of(parameters).items():
            if robot_parameters.comes_on_topic(values["description"]):
                topic = resolve(values["description"])
                node.create_subscription(String, topic, self._receiver(robot, values), qos.DESCRIPTION)

    def _receiver(self, robot: str, values: dict) -> Callable[[String], None]:
        def receive(message: String) -> None:
            found, missing = attachments.link_meshes(robot, values, message.data)
            for name, data in found:
                self._bag.attach(name, data)
            for text in missing:
                if text not in self._told:
                    self._told.add(text)
                    self._warn(text)

        return receive
