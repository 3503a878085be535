# SPDX-License-Identifier: Apache-2.0
"""A small robot and its motion: a boom that rotates and slides, with a hook; mast and hook are round."""

import math

from sensor_msgs.msg import JointState

from hpccd_ros.middleware import fields
from hpccd_ros.robots.robot import Robot

URDF = """<?xml version="1.0"?>
<robot name="crane">
  <link name="mast"><collision><geometry><cylinder radius="0.05" length="0.4"/></geometry></collision></link>
  <link name="boom"><collision><origin xyz="0.3 0 0"/><geometry><box size="0.6 0.06 0.04"/></geometry></collision>
  </link>
  <link name="hook"><collision><geometry><sphere radius="0.06"/></geometry></collision></link>
  <joint name="turn" type="revolute"><parent link="mast"/><child link="boom"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="reach" type="prismatic"><parent link="boom"/><child link="hook"/><origin xyz="0.6 0 0"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>
"""
ROOT = "mast"
LINKS = ("crane/mast", "crane/boom", "crane/hook")


def robot(text=URDF, name="crane") -> Robot:
    return Robot.of(text, name=name)


def values(k: float) -> dict[str, float]:
    """Of both joints in frame k."""
    return {"turn": 0.5 * math.sin(0.9 * k), "reach": 0.1 * math.cos(k)}


def joint_state(k: float, stamp_ns: int) -> JointState:
    at = values(k)
    message = JointState(name=list(at), position=list(at.values()))
    message.header.stamp = fields.ns_to_stamp(stamp_ns)
    return message
