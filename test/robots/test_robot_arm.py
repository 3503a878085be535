# SPDX-License-Identifier: Apache-2.0
"""The arm to try with: its motion, its description, and that it does not touch itself or the table."""

import io
from itertools import combinations

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_ros.robots import arm
from hpccd_ros.robots.robot import Robot

TIMES = np.linspace(-0.5, arm.DURATION + 0.5, 141)


@pytest.fixture(scope="module")
def robot():
    return Robot.of(arm.description())


def joints(t):
    return np.array(list(arm.joint_positions(t).values()))


def test_seven_joints_turn_and_two_fingers_slide(robot):
    kinds = [joint.kind for joint in robot.description.joints]
    assert (kinds.count("revolute"), kinds.count("prismatic"), kinds.count("fixed")) == (7, 2, 1)
    assert robot.kinematics.inputs == (*arm.JOINTS, arm.FINGER)
    assert [mesh.link for mesh in robot.meshes] == [link.name for link in robot.description.links]


def test_yourdfpy_reads_it_and_agrees(robot):
    yourdfpy = pytest.importorskip("yourdfpy", reason="yourdfpy comes with the extra urdf_peer")
    peer = yourdfpy.URDF.load(io.BytesIO(arm.description().encode()))
    assert peer.validate() and peer.actuated_joint_names == [*arm.JOINTS, arm.FINGER]
    positions = arm.joint_positions(2.7)
    peer.update_cfg({name: positions[name] for name in peer.actuated_joint_names})
    for link, pose in robot.kinematics.state(positions).poses.items():
        found = peer.get_transform(link, "base")
        assert np.abs(found[:3, :3] - pose.rotation()).max() < 1e-12
        assert np.abs(found[:3, 3] - pose.shift).max() < 1e-12


def test_the_tip_goes_where_it_should_with_the_gripper_down(robot):
    end = np.array([0.0, 0.0, 0.06])
    for t in TIMES:
        poses = robot.kinematics.state(arm.joint_positions(t)).poses
        left, right = (poses[f"finger_{side}"].apply(end[None])[0] for side in ("left", "right"))
        place, yaw = arm.tip(min(max(t, 0.0), arm.DURATION))
        assert np.abs((left + right) / 2 - place).max() < 1e-12
        assert poses["hand"].rotation()[:, 2] == pytest.approx([0, 0, -1])
        across = poses["hand"].rotation()[:, 1]
        assert across == pytest.approx([-np.sin(yaw), np.cos(yaw), 0])
        assert np.linalg.norm(left - right) == pytest.approx(2 * arm.joint_positions(t)[arm.FINGER])


def test_it_drags_across_the_table_with_closed_fingers():
    for t, (x, y) in ((2.0, arm.GRASP), (5.0, arm.RELEASE)):
        assert arm.tip(t)[0] == pytest.approx([x, y, arm.CLEARANCE])
        assert arm.TABLE[0] < x < arm.TABLE[1] and arm.TABLE[2] < y < arm.TABLE[3]
    heights = [arm.tip(t)[0][2] for t in np.linspace(2.0, 5.0, 31)]
    assert max(heights) == pytest.approx(arm.CLEARANCE + arm.RAISED) and min(heights) == arm.CLEARANCE
    for t in np.linspace(2.0, 5.0, 31):
        assert arm.joint_positions(t)[arm.FINGER] == pytest.approx(arm.CLOSED)
    assert arm.joint_positions(0.0)[arm.FINGER] == arm.joint_positions(5.5)[arm.FINGER] == pytest.approx(arm.OPEN)


def test_the_motion_is_smooth_turns_all_joints_and_keeps_their_limits(robot):
    step = 1e-3
    path = np.array([joints(t) for t in np.arange(-0.1, arm.DURATION + 0.1, step)])
    speed = np.diff(path, axis=0) / step
    assert np.abs(speed).max() < 2.0
    assert np.abs(np.diff(speed, axis=0) / step).max() < 10.0  # no corner: that were 2 / 0.001
    assert np.ptp(path, axis=0).min() > 0.03 and np.ptp(path[:, :7], axis=0).min() > 0.1
    limits = {joint.name: joint.limits for joint in robot.description.joints}
    for t in TIMES:
        for name, value in arm.joint_positions(t).items():
            assert limits[name][0] <= value <= limits[name][1]


def test_it_is_at_rest_before_and_after():
    assert arm.joint_positions(-1.0) == arm.joint_positions(0.0)
    assert arm.joint_positions(99.0) == arm.joint_positions(arm.DURATION)


def test_it_touches_neither_itself_nor_the_table(robot):
    x0, x1, y0, y1 = arm.TABLE
    table = np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0]], float)
    scene = hc.Scene()
    for mesh in robot.meshes:
        scene.add_mesh(mesh.name, mesh.topology.faces, self_collision=False)
    scene.add_mesh("table", np.array([[0, 1, 2], [0, 2, 3]]), static=True)
    for pair in robot.ignored_pairs:
        scene.ignore_pair(*pair)
    detector = hc.Detector(scene)
    for t in TIMES:
        placements = robot.placements(robot.kinematics.state(arm.joint_positions(t)))
        gaps = detector.distances(np.concatenate([*(p.vertices for p in placements), table]))
        named = {frozenset((gap.mesh_a, gap.mesh_b)) for gap in gaps}
        assert len(named) == len(list(combinations(robot.meshes, 2))) - len(robot.ignored_pairs) + len(robot.meshes)
        # Between the fingers, and between these and the table.
        assert min(gap.distance for gap in gaps) > 0.9 * arm.CLEARANCE, min(gaps, key=lambda gap: gap.distance)
