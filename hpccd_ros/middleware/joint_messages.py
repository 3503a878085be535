# SPDX-License-Identifier: Apache-2.0
"""Messages of joint states, for the node and the replay of its recordings."""

from collections.abc import Iterable
from typing import Any

from hpccd_ros.frames.drops import Input, Reason, Refusal
from hpccd_ros.middleware import fields
from hpccd_ros.robots.joint_frames import JointFrames


def fill(robots: Iterable[JointFrames], message: Any, topic: str) -> list[Refusal]:
    """Give a sensor_msgs/JointState of ``topic`` to the robots that it moves; one that cannot be used is refused."""
    try:
        stamp = fields.stamp_to_ns(message.header.stamp)
        for robot in robots:
            robot.add(stamp, message.name, message.position)
    except ValueError as error:  # RobotError is one
        return [Refusal(topic, Reason.MALFORMED, str(error), what=Input.JOINT_STATE)]
    return []
