# SPDX-License-Identifier: Apache-2.0
"""Robots whose description comes on a topic: which mesh files they need is known only then."""

from collections.abc import Callable

from rclpy.node import Node
from std_msgs.msg import String

from hpccd_ros.bag.writer import BagWriter
from hpccd_ros.middleware import qos
from hpccd_ros.params import robot_parameters
from hpccd_ros.record import attachments

# Anybody may publish descriptions: bound what they can make a recorder read and keep, of one robot.
MOST_READ = 100


class DescribedRobots:
    """Attaches to ``bag`` what descriptions name that `node` hears, of each robot the first MOST_READ. parameters: of
    the recorded node. resolve: relative -> absolute topic name. warn: takes what could not be read."""

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
        self._told: set[str] = set()  # bounded, as what is read is
        for robot, values in robot_parameters.of(parameters).items():
            if robot_parameters.comes_on_topic(values["description"]):
                topic = resolve(values["description"])
                node.create_subscription(String, topic, self._receiver(robot, values), qos.DESCRIPTION)

    def _receiver(self, robot: str, values: dict) -> Callable[[String], None]:
        read: set[int] = set()

        def receive(message: String) -> None:
            if len(read) >= MOST_READ or (text := hash(message.data)) in read:
                return
            read.add(text)
            found, missing = attachments.link_meshes(robot, values, message.data)
            for name, data in found:
                if not self._bag.attach(name, data):
                    self._bag.attach(attachments.changed_link_mesh_name(name, message.data), data)
            for text in missing:
                if text not in self._told:
                    self._told.add(text)
                    self._warn(text)

        return receive
