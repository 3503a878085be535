# SPDX-License-Identifier: Apache-2.0
"""The detection of the node on frames whose links joints move: what screws would miss is found."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hpccd_core.rigid.joints import LinkMotion
from hpccd_core.rigid.motion import ScrewMotion
from hpccd_core.rigid.transform import IDENTITY, Rigid
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.rigid_step import RigidOptions, motions
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames.types import MeshSettings, Placement, SceneFrame, Topology
from hpccd_ros.robots.robot import Robot

# Two joints that turn against each other: the plate at the end keeps its direction, and goes on an arc of radius 1.
URDF = """<robot name="r"><link name="base"/><link name="rod"/>
<link name="plate"><collision><geometry><box size="0.02 0.02 0.4"/></geometry></collision></link>
<joint name="one" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 0 1"/></joint>
<joint name="two" type="revolute"><parent link="rod"/><child link="plate"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/>
</joint></robot>"""
PIN = np.array([[0.985, -0.01, 0.0], [1.015, -0.01, 0.0], [1.0, 0.01, 0.01]])
PIN_FACES = Topology(0, 3, np.array([[0, 1, 2]], np.uint32))


@pytest.fixture
def robot():
    return Robot.of(URDF)


def frame(robot, stamp, angle, base=IDENTITY, by_joints=True):
    placements = robot.placements(robot.kinematics.state({"one": angle, "two": -angle}, base))
    if not by_joints:
        placements = tuple(Placement(p.body, p.pose) for p in placements)
    vertices = (*(p.vertices for p in placements), PIN)
    topologies = (*(mesh.topology for mesh in robot.meshes), PIN_FACES)
    return SceneFrame(stamp, stamp, "", topologies, vertices, (), 0.0, (*placements, None))


def detector(robot):
    builder = SceneBuilder((*robot.settings(), MeshSettings("pin", static=True)), robot.ignored_pairs)
    return StepDetector(builder, Options(backend="cpu", threads=1, rigid=RigidOptions(1e-3, 64)))


@pytest.mark.parametrize("base", [IDENTITY, Rigid.of([0.0, 0.0, 0.05], [0, 0, 0, 1])], ids=["at rest", "raised"])
def test_the_arc_is_seen_by_joints_and_not_by_screws(robot, base):
    by_joints = detector(robot).detect(frame(robot, 1, -0.5), frame(robot, 2, 0.5, base))
    assert len(by_joints.contacts) and by_joints.bounds.parts > 1
    assert 0 < max(by_joints.bounds.of_meshes) < 1.01e-3
    by_screws = detector(robot).detect(
        frame(robot, 1, -0.5, by_joints=False), frame(robot, 2, 0.5, base, by_joints=False)
    )
    assert not len(by_screws.contacts)


def test_motions_go_by_joints_only_where_both_ends_tell_them(robot):
    ends = frame(robot, 1, 0.0), frame(robot, 2, 0.3)
    poses = frame(robot, 2, 0.3, by_joints=False)
    other = Robot.of(URDF)
    found = {
        "joints": motions((ends[0].vertices, ends[1].vertices), *ends)[0],
        "mixed": motions((ends[0].vertices, poses.vertices), ends[0], poses)[0],
    }
    assert isinstance(found["joints"], LinkMotion) and isinstance(found["mixed"], ScrewMotion)
    fresh = frame(other, 2, 0.3)  # a description that came again: another body
    assert not isinstance(motions((ends[0].vertices, fresh.vertices), ends[0], fresh)[0], LinkMotion)


def test_links_of_one_robot_share_what_is_computed_of_its_joints(robot):
    both = Robot.of(
        URDF.replace(
            '<link name="rod"/>',
            '<link name="rod"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>',
        )
    )
    start, end = frame(both, 1, 0.0), frame(both, 2, 0.3)
    first, second, _ = motions((start.vertices, end.vertices), start, end)
    assert first.step is second.step


def test_a_placement_that_a_transform_moves_takes_its_base_along(robot):
    (placement,) = robot.placements(robot.kinematics.state({"one": 0.2, "two": 0.1}))
    turn = Rigid.of([1.0, 2.0, 3.0], [0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)])
    moved = placement.moved(turn)
    assert np.abs(moved.vertices - turn.apply(placement.vertices)).max() < 1e-14
    assert np.array_equal(moved.state.base.shift, turn.shift) and moved.state.inputs == placement.state.inputs


def test_a_joint_that_jumps_costs_no_more_parts_than_allowed_and_reaches_no_farther_than_the_robot(robot):
    start, end = frame(robot, 1, 0.0), frame(robot, 2, 1e6)
    far = replace(end, vertices=(end.vertices[0], PIN + [10.0, 0.0, 0.0]))
    found = detector(robot).detect(start, end)
    assert found.bounds.parts == 64 and 1.0 < max(found.bounds.of_meshes) < 2.5 and len(found.contacts)
    start = replace(start, vertices=(start.vertices[0], far.vertices[1]))
    assert not len(detector(robot).detect(start, far).contacts)
