# SPDX-License-Identifier: Apache-2.0
"""Messages of joint states that are kept for robots which are not known yet."""

import crane
import pytest
from sensor_msgs.msg import JointState

from hpccd_core.rigid.transform import IDENTITY
from hpccd_ros.middleware import joint_messages
from hpccd_ros.robots.joint_frames import JointFrames


def frames(turn="turn"):
    return JointFrames(crane.robot(crane.URDF.replace('"turn"', f'"{turn}"')), IDENTITY, "mast", "world", 10)


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


def test_a_message_of_velocities_alone_is_kept_and_not_rejected():
    message = crane.joint_state(1, 1)
    message.position, message.velocity = [], [0.0, 0.0]
    for given in (message, joint_messages.kept(message)):
        assert joint_messages.fill([frames()], given, "joint_states") == []


def test_what_no_robot_can_use_is_rejected_before_any_is_known():
    message = crane.joint_state(1, 1)
    assert joint_messages.fill([], message, "joint_states") == []
    message.position = message.position[:1]
    (rejection,) = joint_messages.fill([], message, "joint_states")
    assert "2 names and 1 position" in rejection.text
    message = crane.joint_state(1, 1)
    message.header.stamp.sec = -1
    (rejection,) = joint_messages.fill([], message, "joint_states")
    assert "stamp has sec -1" in rejection.text


@pytest.mark.parametrize("first", [True, False])
def test_what_one_robot_cannot_use_moves_the_others(first):
    sound, broken = frames(), frames("spin")
    message = JointState(name=["turn", "reach", "spin"], position=[0.0, 0.0, float("nan")])
    (rejection,) = joint_messages.fill([sound, broken] if first else [broken, sound], message, "joint_states")
    assert "'spin' is nan in the joint state of 0 ns" in rejection.text
    assert sound.latest(None) == [0]
    with pytest.raises(LookupError, match="^crane: 'spin' is nan in the joint state of 0 ns$"):
        broken.latest(None)
