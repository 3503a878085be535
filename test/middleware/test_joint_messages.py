# SPDX-License-Identifier: Apache-2.0
"""Messages of joint states that are kept for robots which are not known yet."""

import crane
import pytest
from sensor_msgs.msg import JointState

from hpccd_ros.middleware import joint_messages
from hpccd_ros.rigid.transform import IDENTITY
from hpccd_ros.robots.joint_frames import JointFrames


def frames():
    return JointFrames(crane.robot(), IDENTITY, "mast", "world", 10)


def test_what_is_kept_fills_a_robot_as_the_message_does():
    message = crane.joint_state(3, 7)
    message.velocity, message.effort, message.header.frame_id = [0.0] * 100_000, [1.0] * 100_000, "x" * 100_000
    kept = joint_messages.kept(message)
    assert not kept.velocity and not kept.effort and not kept.header.frame_id
    for given in (message, kept):
        robot = frames()
        assert joint_messages.fill([robot], given, "joint_states") == []
        assert robot.latest(None) == [7]


@pytest.mark.parametrize("names, positions", [(0, 100_000), (1001, 1001), (2, 1)])
def test_what_is_too_large_or_of_no_use_is_not_kept(names, positions):
    message = JointState(name=[f"j{k}" for k in range(names)], position=[0.0] * positions)
    assert joint_messages.kept(message) is None
    assert joint_messages.kept(JointState(name=["j" * 1_000_000], position=[0.0])) is None
