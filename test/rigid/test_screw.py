# SPDX-License-Identifier: Apache-2.0
"""The screw between two poses, and how far straight lines are from it."""

import math

import numpy as np
import pytest
from random_poses import quaternion, random_screw, true_vertices

from hpccd_core.rigid.body import Body
from hpccd_core.rigid.screw import Screw
from hpccd_core.rigid.transform import IDENTITY, Rigid

ANGLES = (0.0, 1e-300, 1e-15, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 2.0, 3.0, math.pi - 1e-9)


def test_a_quarter_turn_about_an_axis_elsewhere():
    """About the z axis through (1, 0, 0), up by 2."""
    screw = Screw.between(IDENTITY, Rigid.of((1, -1, 2), quaternion((0, 0, 1), math.pi / 2)))
    assert screw.angle == pytest.approx(math.pi / 2)
    assert screw.axis == pytest.approx([0, 0, 1])
    assert screw.slide == pytest.approx(2)
    assert screw.point[:2] == pytest.approx([1, 0])
    half = screw.vertices(Body.of(np.zeros((1, 3))), 0.5)[0]
    assert half == pytest.approx([1 - math.sqrt(0.5), -math.sqrt(0.5), 1])
    # r = 1 from the axis; the straight line is off by 1 - cos(45 degrees), cut in two by 1 - cos(22.5 degrees)
    body = Body.of(np.zeros((1, 3)))
    assert screw.deviation(body) == pytest.approx(1 - math.sqrt(0.5))
    assert screw.deviation(body, 2) == pytest.approx(1 - math.cos(math.pi / 8))


def test_a_shift_alone_deviates_by_nothing():
    pose = Rigid.of((1, 2, 3), quaternion((1, 2, 3), 1.0))
    for other in (pose.quaternion, -pose.quaternion):
        screw = Screw.between(pose, Rigid(other, np.array([4.0, 6.0, 3.0])))
        assert (screw.angle, screw.slide, screw.point) == (0.0, 5.0, None)
        assert screw.deviation(Body.of(np.eye(3))) == 0.0
        assert screw.pose(0.5).shift.tolist() == [2.5, 4.0, 3.0]


def test_no_vertices():
    assert random_screw(np.random.default_rng(0), 1.0).deviation(Body.of(np.zeros((0, 3)))) < 1e-12


@pytest.mark.parametrize("angle", [0.3, math.pi])
def test_a_quaternion_and_its_negative_mean_the_same_motion(angle):
    first, second = IDENTITY.quaternion, quaternion((0, -0.6, 0.8), angle)
    if angle == math.pi:
        second = np.array([0, -0.6, 0.8, 0.0])
    shift = np.array([1.0, 0, 0])
    poses = {
        tuple(pose.quaternion * np.sign(pose.quaternion[3])) + tuple(pose.shift)
        for a in (first, -first)
        for b in (second, -second)
        for pose in [Screw.between(Rigid(a, np.zeros(3)), Rigid(b, shift)).pose(0.25)]
    }
    assert len(poses) == 1


def test_at_half_a_turn_the_first_component_of_the_axis_is_positive():
    for axis in ((0, -0.6, 0.8), (0, 0.6, -0.8), (-1, 0, 0), (0, 0, -1)):
        screw = Screw.between(IDENTITY, Rigid.of((0, 0, 0), (*axis, 0.0)))
        assert screw.angle == math.pi
        assert next(c for c in screw.axis if c) > 0


def test_the_ends_are_the_poses_bit_for_bit():
    screw = random_screw(np.random.default_rng(3), 1.0, far=10.0)
    assert screw.pose(0.0) is screw.start and screw.pose(1.0) is screw.end


@pytest.mark.parametrize("far", [0.0, 1e6])
@pytest.mark.parametrize("angle", ANGLES)
def test_no_point_leaves_the_bound_and_one_reaches_it(angle, far):
    rng = np.random.default_rng(int(angle * 1000) + int(far))
    t = np.linspace(0, 1, 81)
    for parts in (1, 2, 5):
        screw = random_screw(rng, angle, far, way=10.0 ** rng.uniform(-3, 1))
        points = rng.standard_normal((12, 3))
        bound = screw.deviation(Body.of(points), parts)
        size = 2 * Body.of(points).radius + np.linalg.norm(screw.end.shift - screw.start.shift)
        worst = 0.0
        for part in range(parts):
            ends = [true_vertices(screw, points, np.longdouble(part + k) / parts) for k in (0, 1)]
            for u in t:
                true = true_vertices(screw, points, (part + np.longdouble(u)) / parts)
                straight = (1 - np.longdouble(u)) * ends[0] + np.longdouble(u) * ends[1]
                worst = max(worst, float(np.sqrt(((true - straight) ** 2).sum(axis=1)).max()))
        assert worst <= bound + 1e-18 * (1 + size)  # the rounding of the 64 bits
        # t has the middle, where the deviation is greatest; the slack for rounding is all that is above it.
        assert bound <= worst * (1 + 1e-9) + 2e-14 * size
