# SPDX-License-Identifier: Apache-2.0
"""Writes the messages of topics into a recording, by raw subscriptions, so that it contains the bytes that were sent;
and the mesh files of robots whose description comes on a topic, because they are known only then."""

import time
from collections.abc import Callable

from rclpy.node import Node
from std_msgs.msg import String

from hpccd_ros.bag import qos_yaml
from hpccd_ros.bag.writer import BagWriter, Topic
from hpccd_ros.middleware import qos
from hpccd_ros.middleware.message_types import message_class
from hpccd_ros.params import robot_parameters
from hpccd_ros.record import attachments, recorded_topics
from hpccd_ros.record.recorded_topics import Wanted


class Recorder:
    """Subscribes to the wanted topics through `node` and writes every message to `bag` until told to stop.

    received: messages so far, by resolved topic name. lost: messages that did not arrive, by topic, found by gaps in
    the publisher's sequence numbers (for topics with one publisher).
    """

    def __init__(self, node, bag: BagWriter, wanted: list[Wanted], depth: int, qos_of=recorded_topics.subscription_qos):
        self._node = node
        self._bag = bag
        self.received: dict[str, int] = {}
        self.lost: dict[str, int] = {}
        self.taken = 0  # messages from the middleware, including those after the end
        self._end: int | None = None
        self._sequence: dict[str, int] = {}
        self._subscriptions = {}
        for topic in wanted:
            name = node.resolve_topic_name(topic.name)
            qos = qos_of(node, name, topic, depth)
            self.received[name] = 0
            self._subscriptions[name] = node.create_subscription(
                message_class(topic.type_name), name, self._receiver(name, topic), qos, raw=True
            )

    @property
    def topics(self) -> list[str]:
        return list(self._subscriptions)

    def publishers(self, topic: str) -> int:
        """Publishers that this recorder is connected to on `topic` (resolved name)."""
        return self._subscriptions[topic].get_publisher_count()

    def end(self) -> None:
        """From now on take only messages that had arrived before; later ones do not belong to the recording."""
        self._end = time.time_ns()

    def finish(self, executor, depth: int) -> None:
        """`end`, and take waiting messages through `executor`: at most `depth` of each topic."""
        self.end()
        most = self.taken + depth * len(self.topics)
        taken = -1
        while taken != self.taken and self.taken < most:
            taken = self.taken
            executor.spin_once(timeout_sec=0.05)

    def _receiver(self, name, topic):
        def receive(data, info):
            self.taken += 1
            if self._end is not None and info["received_timestamp"] > self._end:
                return
            if self.received[name] == 0:
                in_force = max(topic.latched, topic.kept)
                self._bag.add_topic(Topic(name, topic.type_name, self._offered_qos(name), in_force))
            self.received[name] += 1
            self._watch_for_loss(name, info["publication_sequence_number"])
            self._bag.write(
                name, data, info["received_timestamp"], info["source_timestamp"], info["publication_sequence_number"]
            )

        return receive

    def _offered_qos(self, name):
        offers = [p.qos_profile for p in self._node.get_publishers_info_by_topic(name)]
        # A publisher that sent and left at once is no longer listed: it offered what was requested.
        return qos_yaml.offered_qos(offers or [self._subscriptions[name].qos_profile])

    def _watch_for_loss(self, name, sequence):
        last = self._sequence.get(name)
        self._sequence[name] = sequence
        if last is not None and sequence > last + 1 and self.publishers(name) == 1:
            self.lost[name] = self.lost.get(name, 0) + sequence - last - 1


# Anyone may publish descriptions: limit the memory and files of one robot.
MOST_READ = 100


class DescribedRobots:
    """Attaches to ``bag`` the files named by descriptions that `node` receives, for each robot the first MOST_READ.
    parameters: of the recorded node. resolve: relative -> absolute topic name. warn: called for unreadable files."""

    def __init__(
        self, node: Node, bag: BagWriter, parameters: dict, resolve: Callable[[str], str], warn: Callable[[str], object]
    ) -> None:
        self._bag = bag
        self._warn = warn
        self._logged: set[str] = set()  # bounded, because reading is
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
                if text not in self._logged:
                    self._logged.add(text)
                    self._warn(text)

        return receive
