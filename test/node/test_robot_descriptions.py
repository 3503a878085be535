# SPDX-License-Identifier: Apache-2.0
"""Descriptions that come on a topic, however often."""

import itertools
import time

import crane
import pytest
import rclpy
from node_process import PATIENCE
from rclpy.executors import SingleThreadedExecutor
from std_msgs.msg import String

from hpccd_ros.middleware import environment, qos
from hpccd_ros.node.life_cycle import GuardedLifecycleNode
from hpccd_ros.node.robot_descriptions import PERIOD, RobotDescriptions
from hpccd_ros.params import values

LONGER = crane.URDF.replace('"0.6 0.06 0.04"', '"0.9 0.06 0.04"')


@pytest.fixture
def place():
    """A node that is configured, a publisher of descriptions to it, and ``spin`` for some seconds."""
    environment.prepare()
    context = rclpy.Context()
    rclpy.init(context=context)

    class Place:
        node = GuardedLifecycleNode("described", context=context)
        executor = SingleThreadedExecutor(context=context)
        publisher = node.create_publisher(String, "robot_description", qos.DESCRIPTION)

        def spin(self, seconds):
            until = time.monotonic() + seconds
            while (left := until - time.monotonic()) > 0:
                self.executor.spin_once(timeout_sec=left)

    place = Place()
    place.executor.add_node(place.node)
    yield place
    place.executor.shutdown()
    place.node.unconfigure()
    place.node.destroy_node()
    rclpy.try_shutdown(context=context)


@pytest.mark.parametrize("other", [LONGER, "<robot"])
def test_descriptions_that_come_fast_are_read_once_a_period_and_the_last_one_is_in_force(place, other, monkeypatch):
    settings, _ = values.checked({"robots": ["crane"], "robot.crane.joint_states": "joint_states"})
    begun, ended, read = [], [], []
    made = RobotDescriptions._made

    def make(descriptions, name, text):
        begun.append(time.monotonic())
        ended.append(time.monotonic())
        read.append(text)
        return made(descriptions, name, text)

    def follow():
        time.sleep(0.3)  # as another scene takes
        ended[-1] = time.monotonic()

    monkeypatch.setattr(RobotDescriptions, "_made", make)
    robots = RobotDescriptions(place.node, settings, follow)
    texts = itertools.cycle([crane.URDF, other])
    until = time.monotonic() + 6.5 * PERIOD
    while time.monotonic() < until:
        place.publisher.publish(String(data=next(texts)))
        place.spin(0.013)
    last = crane.URDF.replace('"0.6 0.06 0.04"', '"0.3 0.06 0.04"')
    place.publisher.publish(String(data=last))
    deadline = time.monotonic() + PATIENCE
    while read[-1] != last:
        assert time.monotonic() < deadline, robots.warnings()
        place.spin(0.05)
    assert robots.complete and not robots.warnings() and len(read) >= 4
    pauses = [start - end for end, start in zip(ended, begun[1:], strict=False)]
    assert min(pauses) >= PERIOD, pauses


def test_robots_of_one_topic_are_known_together(place):
    given = {"robots": ["left", "right"], "robot.left.joint_states": "joints", "robot.right.joint_states": "joints"}
    settings, _ = values.checked(given)
    known = []
    robots = RobotDescriptions(place.node, settings, lambda: known.append((time.monotonic(), sorted(robots.robots))))
    place.publisher.publish(String(data=crane.URDF))
    deadline = time.monotonic() + PATIENCE
    while not robots.complete:
        assert time.monotonic() < deadline, robots.warnings()
        place.spin(0.05)
    assert known[-1][1] == ["left", "right"] and known[-1][0] - known[0][0] < PERIOD / 2
