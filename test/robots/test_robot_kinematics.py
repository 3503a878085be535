# SPDX-License-Identifier: Apache-2.0
"""Where links are: against matrices, and against yourdfpy."""

import io
import math

import numpy as np
import pytest
from random_urdf import matrices, random_urdf, turn

from hpccd_core.rigid.body import Body
from hpccd_core.rigid.transform import IDENTITY, Rigid
from hpccd_ros.robots import urdf
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.kinematics import Kinematics

HINGE = """<robot name="hinge"><link name="a"/><link name="b"/><link name="c"/>
<joint name="first" type="{kind}"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>
<joint name="second" type="revolute"><parent link="b"/><child link="c"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/>
<mimic joint="first" multiplier="3" offset="0.5"/></joint></robot>"""


def as_matrix(pose):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = pose.rotation(), pose.shift
    return matrix


def made(text):
    return Kinematics(urdf.parse(text))


@pytest.mark.parametrize("seed", range(40))
def test_poses_of_random_robots_are_those_of_matrices(seed):
    rng = np.random.default_rng(seed)
    text, movable = random_urdf(rng, links=int(rng.integers(1, 15)))
    kinematics = made(text)
    assert set(kinematics.inputs) == set(movable)
    for _ in range(5):
        positions = {name: rng.uniform(-7, 7) for name in movable}
        truth, found = matrices(text, positions), kinematics.state(positions).poses
        assert set(truth) == set(found)
        for link, matrix in truth.items():
            assert np.abs(as_matrix(found[link]) - matrix).max() < 1e-12 * (1 + np.abs(matrix).max()), link


@pytest.mark.parametrize("seed", range(15))
def test_poses_are_those_of_yourdfpy(seed):
    yourdfpy = pytest.importorskip("yourdfpy", reason="yourdfpy comes with the extra urdf_peer")
    rng = np.random.default_rng(100 + seed)
    text, movable = random_urdf(rng, links=10)
    peer = yourdfpy.URDF.load(io.BytesIO(text.encode()), build_scene_graph=True, load_meshes=False)
    kinematics = made(text)
    assert set(peer.actuated_joint_names) == set(movable)
    positions = {name: rng.uniform(-3, 3) for name in movable}
    peer.update_cfg(positions)
    root = peer.base_link
    for link, pose in kinematics.state(positions).poses.items():
        assert np.abs(as_matrix(pose) - peer.get_transform(link, root)).max() < 1e-9, link


def test_the_base_places_all():
    text, movable = random_urdf(np.random.default_rng(5), links=6)
    positions = dict.fromkeys(movable, 0.7)
    base = Rigid.of([1.0, 2.0, 3.0], [0.5, 0.5, 0.5, 0.5])
    placed, own = (made(text).state(positions, b).poses for b in (base, IDENTITY))
    for link in own:
        assert np.abs(as_matrix(placed[link]) - as_matrix(base) @ as_matrix(own[link])).max() < 1e-13


def test_missing_and_unusable_positions_are_named():
    kinematics = made(HINGE.format(kind="revolute"))
    with pytest.raises(RobotError, match="positions: none for first"):
        kinematics.state({"second": 1.0})
    with pytest.raises(RobotError, match="not finite, or beyond 1e.09, for first, second"):
        kinematics.state({"first": math.nan})
    with pytest.raises(RobotError, match="for first, second"):
        kinematics.state({"first": -1.1e9})
    with pytest.raises(RobotError, match="for second"):  # which is at three times that
        kinematics.state({"first": 0.9e9})
    assert kinematics.state({"first": 1.0, "of another robot": math.nan}).inputs == {"first": 1.0}


def test_a_chain_of_mimics_is_followed():
    text = HINGE.format(kind="revolute").replace(
        "</robot>",
        '<link name="d"/><joint name="third" type="prismatic"><parent link="c"/><child link="d"/><axis xyz="0 2 0"/>'
        '<mimic joint="second" multiplier="-2" offset="1"/></joint></robot>',
    )
    assert made(text).state({"first": 0.1}).values.tolist() == pytest.approx([0, 0.1, 0.8, -0.6])


def sampled(kinematics, start, end, link, points, t, continuous=False):
    """The points at the fraction t of constant joint speeds, by matrices."""
    change = {n: end[n] - start[n] for n in start}
    if continuous:
        change = {n: math.remainder(c, 2 * math.pi) for n, c in change.items()}
    pose = kinematics.state({n: start[n] + t * change[n] for n in start}).poses[link]
    return pose.apply(points)


@pytest.mark.parametrize("seed", range(25))
def test_no_point_leaves_the_bound_of_its_straight_line(seed):
    rng = np.random.default_rng(200 + seed)
    text, movable = random_urdf(rng, links=9)
    kinematics = made(text)
    start = {name: rng.uniform(-2, 2) for name in movable}
    # Below half a turn, so that the shorter way of continuous ones is the one sampled.
    end = {name: value + rng.uniform(-0.6, 0.6) for name, value in start.items()}
    body = Body.of(0.3 * rng.normal(size=(6, 3)))
    step = kinematics.step(kinematics.state(start), kinematics.state(end))
    for link in kinematics.links:
        motion = step.motion(link, body)
        for parts in (1, 3):
            room = motion.deviation(parts) + motion.rounding(parts) + 1e-13
            for part in range(parts):
                a, b = motion.vertices(part, parts), motion.vertices(part + 1, parts)
                for u in np.linspace(0, 1, 17):
                    true = sampled(kinematics, start, end, link, body.vertices, (part + u) / parts)
                    assert np.linalg.norm(true - ((1 - u) * a + u * b), axis=1).max() <= room


def test_a_continuous_joint_takes_its_followers_the_shorter_way():
    body = Body.of(np.array([[0.1, 0.2, 0.0]]))
    kinematics = made(HINGE.format(kind="continuous"))
    start, end = {"first": 3.0}, {"first": -3.0}
    step = kinematics.step(kinematics.state(start), kinematics.state(end))
    change = 2 * math.pi - 6.0
    assert step.joints.speed.tolist() == pytest.approx([0.0, change, 3 * change])
    for t in (0.0, 0.4, 1.0):
        true = sampled(kinematics, start, end, "c", body.vertices, t, continuous=True)
        assert np.abs(step.poses(t)["c"].apply(body.vertices) - true).max() < 1e-12
    # A joint that is not continuous follows its values.
    revolute = made(HINGE.format(kind="revolute"))
    assert revolute.step(revolute.state(start), revolute.state(end)).joints.speed.tolist() == [0.0, -6.0, -18.0]


@pytest.mark.parametrize("turned", [0.0, 0.4, 3.0])
@pytest.mark.parametrize("way", [0.0, 1e-120, 5e-4, 0.7])
def test_a_moving_base_goes_straight_and_turns_at_constant_speed(turned, way):
    rng = np.random.default_rng(7)
    text, movable = random_urdf(rng, links=7)
    kinematics = made(text)
    start = {name: rng.uniform(-2, 2) for name in movable}
    end = {name: value + rng.uniform(-0.4, 0.4) for name, value in start.items()}
    axis = np.array([0.6, 0.0, 0.8])
    first = Rigid.of([1.0, -2.0, 0.5], [0.5, -0.5, 0.5, 0.5])
    quaternion = Rigid.of(np.zeros(3), [*(axis * math.sin(turned / 2)), math.cos(turned / 2)]).after(first).quaternion
    second = Rigid(-quaternion, first.shift + way * np.array([0.0, 0.6, -0.8]))
    step = kinematics.step(kinematics.state(start, first), kinematics.state(end, second))
    body = Body.of(0.3 * rng.normal(size=(5, 3)))
    for link in kinematics.links:
        motion = step.motion(link, body)
        ends = motion.vertices(0, 1), motion.vertices(1, 1)
        for u in np.linspace(0, 1, 21):
            local = sampled(kinematics, start, end, link, body.vertices, u)
            true = local @ (turn(axis, u * turned) @ first.rotation()).T + first.shift
            true += u * (second.shift - first.shift)
            assert np.abs(step.poses(u)[link].apply(body.vertices) - true).max() < 1e-12
            off = np.linalg.norm(true - ((1 - u) * ends[0] + u * ends[1]), axis=1).max()
            assert off <= motion.deviation(1) + motion.rounding(1) + 1e-13
    if not turned and not way:
        assert step.ahead == 2  # -q is the same turn, written otherwise
