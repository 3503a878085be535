# SPDX-License-Identifier: Apache-2.0
"""Messages of robots as CDR bytes, against an independent writer and against ROS."""

import pytest
from rclpy.serialization import deserialize_message
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from hpccd_ros.middleware import mesh_cdr, message_types

STORE = get_typestore(Stores.ROS2_JAZZY)


@pytest.mark.parametrize(
    "positions",
    [{}, {"a": 0.5}, {"joint_1": -1.25, "joint_12": 2.0**-20}, {"côté": 1.0, "abc": 2.0, "abcd": 3.0, "": -4.0}],
)
def test_joint_states_are_those_of_an_independent_writer_and_of_ros(positions):
    data = mesh_cdr.joint_states(5_000_000_007, positions)
    message = STORE.deserialize_cdr(data, message_types.JOINT_STATES)
    assert bytes(STORE.serialize_cdr(message, message_types.JOINT_STATES)) == data
    for read in (message, deserialize_message(data, JointState)):
        assert (read.header.stamp.sec, read.header.stamp.nanosec, read.header.frame_id) == (5, 7, "")
        assert dict(zip(read.name, read.position, strict=True)) == positions
        assert len(read.velocity) == len(read.effort) == 0


@pytest.mark.parametrize("text", ["", "<robot/>", '<robot name="Gerät">\n</robot>'])
def test_a_description_is_the_text(text):
    data = mesh_cdr.description(text)
    message = STORE.deserialize_cdr(data, message_types.DESCRIPTION)
    assert bytes(STORE.serialize_cdr(message, message_types.DESCRIPTION)) == data
    assert message.data == deserialize_message(data, String).data == text
