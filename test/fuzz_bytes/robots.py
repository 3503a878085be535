# SPDX-License-Identifier: Apache-2.0
"""Descriptions of robots: URDF and SRDF files."""

from hpccd_ros.robots import srdf, urdf
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.robot import Robot
from hpccd_ros.robots.xml_tree import decoded

from .target import Target

URDF = b"""<?xml version="1.0"?>
<robot name="arm"><link name="base"><collision><geometry><box size="1 1 .1"/></geometry></collision></link>
<link name="upper"><collision><origin xyz="0 0 1" rpy="0 .1 0"/><geometry><cylinder radius=".1" length="1"/></geometry>
</collision><collision><geometry><sphere radius=".2"/></geometry></collision></link><link name="tip"><visual><geometry>
<capsule radius=".1" length=".3"/></geometry></visual></link>
<joint name="turn" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 .1"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="slide" type="prismatic"><parent link="upper"/><child link="tip"/><mimic joint="turn" multiplier="2"/>
</joint></robot>"""
_FILE = b"""<robot name="a"><link name="l"><collision><geometry><mesh filename="package://p/m.obj" scale="1 2 3"/>
</geometry></collision></link></robot>"""
_SRDF = b"""<robot name="arm"><group name="g"><link name="base"/></group>
<disable_collisions link1="base" link2="upper" reason="Adjacent"/><enable_collisions link1="base" link2="tip"/>
<disable_default_collisions link="tip"/><group_state name="home" group="g"><joint name="turn" value="0"/></group_state>
</robot>"""
_URDF_WORDS = (
    b"floating", b"continuous", b"fixed", b"<mimic joint=", b"<axis", b"<origin", b'rpy="', b"<mesh", b"xacro:if",
    b"nan",
    b"<!DOCTYPE", b"<!ENTITY a 'b'>", b"&a;", b"\xef\xbb\xbf", b'encoding="utf-16"', b"<robot>", b"planar", b"1e308",
)  # fmt: skip
_LINKS = ("base", "upper", "tip")


def _read_urdf(data: bytes) -> None:
    # Few triangles: this is about the text. A tolerance below that of a sphere's size makes millions.
    Robot.of(decoded(data), tolerance=1.0)
    Robot.of(decoded(data), geometry="visual", name="a", tolerance=1.0)


def _read_srdf(data: bytes) -> None:
    semantics = srdf.parse(decoded(data), _LINKS)
    srdf.ignored(urdf.parse(URDF.decode()), semantics)


TARGETS = {
    "urdf": Target(_read_urdf, lambda: [URDF, _FILE], (RobotError,), words=_URDF_WORDS),
    "srdf": Target(_read_srdf, lambda: [_SRDF], (RobotError,), words=_URDF_WORDS, largest=1000),
}
