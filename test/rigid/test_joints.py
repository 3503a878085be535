# SPDX-License-Identifier: Apache-2.0
"""Links whose joints go at constant speed: no point leaves the bound of its straight line."""

import math

import numpy as np
import pytest
from oracle.rigid_queries import random_motion, random_paths

from hpccd_core.rigid.body import Body
from hpccd_core.rigid.cuts import fewest_parts
from hpccd_core.rigid.joints import Joint, JointStep, LinkMotion
from hpccd_core.rigid.transform import IDENTITY, Rigid

Z = (0.0, 0.0, 1.0)
POINTS = np.array([[0.1, 0.0, 0.0], [0.0, 0.1, 0.1], [-0.1, 0.0, 0.05]])


def shifted(x, y=0.0, z=0.0):
    return Rigid(IDENTITY.quaternion, np.array([x, y, z], float))


def arm(*kinds, length=1.0):
    """Planar: all joints turn about z or slide along x, each ``length`` from the one before."""
    origins = [IDENTITY, *(shifted(length) for _ in kinds[1:])]
    return [
        Joint.of(kind, number - 1, origin, (1, 0, 0) if kind == "prismatic" else Z)
        for number, (kind, origin) in enumerate(zip(kinds, origins, strict=True))
    ]


def deviation(motion, parts=1, samples=81):
    """The greatest distance of a vertex from its straight line, by samples; the middle is one of them."""
    worst = 0.0
    for part in range(parts):
        start, end = motion.vertices(part, parts), motion.vertices(part + 1, parts)
        for k in range(samples):
            u = k / (samples - 1)
            true = motion.step.poses((part + u) / parts)[motion.link].apply(motion.body.vertices)
            worst = max(worst, float(np.linalg.norm(true - ((1 - u) * start + u * end), axis=1).max()))
    return worst


@pytest.mark.parametrize("parts", [1, 3])
def test_random_chains_stay_within_the_bound(parts):
    rng = np.random.default_rng(8)
    paths = random_paths(rng, 150, 3, np.ones(150), "joints")
    ratios = []
    for k in range(150):
        motion = random_motion(paths, k)
        true, bound = deviation(motion, parts, 33), motion.deviation(parts)
        assert true <= bound + motion.rounding(parts)
        if bound > 1e-9:
            ratios.append(true / bound)
    assert max(ratios) > 0.8  # where turns are small the bound is nearly reached


def test_the_samples_are_of_the_true_motion():
    """Forward kinematics against products of matrices that share no code with them."""
    rng = np.random.default_rng(9)
    paths = random_paths(rng, 40, 3, np.ones(40), "joints")
    for k in range(40):
        for t in (0.0, 0.3, 1.0):
            true = paths.at(np.array([k]), np.array([t]), np.longdouble)[0][0]
            motion = random_motion(paths, k)
            found = motion.step.poses(t)[motion.link].apply(motion.body.vertices)
            assert np.abs(found - true).max() < 1e-12


def test_joints_that_turn_against_each_other():
    """The link does not turn; its path is an arc about the first joint, 3 % of the length, which no screw sees."""
    a = 2 * math.acos(0.97)
    step = JointStep(arm("revolute", "revolute"), (0.0, 0.0), (a, -a))
    motion = LinkMotion(step, 1, Body.of(POINTS))
    start, end = (step.poses(t)[1] for t in (0.0, 1.0))
    assert np.allclose(start.quaternion, end.quaternion)
    assert deviation(motion) == pytest.approx(0.03, rel=1e-3)
    assert deviation(motion) <= motion.deviation(1) < 5 * deviation(motion)
    # the smaller the turn, the nearer is the bound
    small = LinkMotion(JointStep(arm("revolute", "revolute"), (0.3, 0.1), (0.301, 0.099)), 1, Body.of(POINTS))
    assert deviation(small) <= small.deviation(1) < 1.01 * deviation(small)


def test_one_joint_that_turns_alone_reaches_the_bound():
    motion = LinkMotion(JointStep(arm("revolute"), (0.0,), (0.01,)), 0, Body.of(np.array([[2.0, 0, 0]])))
    assert motion.deviation(1) == pytest.approx(2 * (1 - math.cos(0.005)), rel=1e-4)
    assert motion.deviation(4) == pytest.approx(motion.deviation(1) / 16)


def test_a_joint_that_slides_on_one_that_turns():
    step = JointStep(arm("revolute", "prismatic"), (0.0, 0.0), (0.02, 3.0))
    motion = LinkMotion(step, 1, Body.of(POINTS))
    assert 0.8 * motion.deviation(1) < deviation(motion) <= motion.deviation(1)


def test_joints_that_slide_first_do_not_bend():
    step = JointStep(arm("prismatic", "prismatic", "fixed"), (0.0, 0.0, 7.0), (1.0, -2.0, 9.0))
    assert [LinkMotion(step, link, Body.of(POINTS)).deviation(1) for link in range(3)] == [0.0, 0.0, 0.0]


def test_a_slide_below_a_turn_adds_nothing():
    turning = LinkMotion(JointStep(arm("revolute"), (0.0,), (0.1,)), 0, Body.of(POINTS))
    carried = LinkMotion(JointStep(arm("prismatic", "revolute"), (0.0, 0.0), (9.0, 0.1)), 1, Body.of(POINTS))
    assert carried.deviation(1) == pytest.approx(turning.deviation(1), rel=1e-6)


def test_a_continuous_joint_goes_the_shorter_way():
    step = JointStep(arm("continuous"), (3.1,), (-3.1,))
    assert abs(step.speed[0]) == pytest.approx(2 * math.pi - 6.2)
    assert abs(JointStep(arm("revolute"), (3.1,), (-3.1,)).speed[0]) == pytest.approx(6.2)


def test_links_of_a_tree():
    """Two fingers on one hand: each moves by the joints on its own way alone."""
    hand = Joint.of("revolute", -1, IDENTITY, Z)
    fingers = [Joint.of("prismatic", 0, shifted(1.0, side), (0, side, 0)) for side in (-0.1, 0.1)]
    step = JointStep([hand, *fingers], (0, 0, 0), (0.0, 0.05, 0.0), shifted(0, 0, 1))
    others = JointStep([hand, *fingers], (0, 0, 0), (0.0, 9.0, 0.0), shifted(0, 0, 1))
    assert LinkMotion(others, 2, Body.of(POINTS)).rounding(1) == LinkMotion(step, 2, Body.of(POINTS)).rounding(1)
    assert step.poses(1.0)[1].shift == pytest.approx([1.0, -0.15, 1.0])
    assert step.poses(1.0)[2].shift == pytest.approx([1.0, 0.1, 1.0])


def test_cut_by_the_tolerance():
    motion = LinkMotion(JointStep(arm("revolute", "revolute"), (0, 0), (1.0, 0.5)), 1, Body.of(POINTS))
    cut = fewest_parts([motion], 1e-3, 100)
    assert cut.enough and cut.parts > 3
    assert deviation(motion, cut.parts) <= 1e-3 < motion.deviation(cut.parts - 1)


@pytest.mark.parametrize("jump", [1e2, 1e6, 1e9])
def test_however_far_a_joint_jumps_the_bound_is_no_larger_than_the_robot(jump):
    """The base stands far away, and a slide that does not move is between: neither is a reason for a larger bound."""
    chain = arm("fixed", "revolute", "prismatic", "revolute", length=0.5)
    step = JointStep(chain, (0, 0, 0.25, 0), (0, jump, 0.25, -jump / 3), shifted(1e6))
    motion = LinkMotion(step, 3, Body.of(POINTS))
    size = 0.5 + 0.5 + 0.25 + motion.body.radius
    cut = fewest_parts([motion], 1e-3, 64)
    assert (cut.parts, cut.enough) == (64, False)
    bounds = [motion.deviation(parts) for parts in (1, 7, 64, 1000)]
    assert bounds == sorted(bounds, reverse=True) and bounds[0] <= 2.0 * size * (1 + 1e-12)
    for parts, bound in zip((1, 7, 64), bounds, strict=False):
        true = deviation(motion, parts, 33)
        assert true <= bound + motion.rounding(parts)
        assert true > 0.5 * size or parts > 1


def test_a_slide_before_the_turn_counts_where_it_goes():
    step = JointStep(arm("prismatic", "revolute"), (0, 0), (30.0, 1e6))
    motion = LinkMotion(step, 1, Body.of(POINTS))
    assert deviation(motion) <= motion.deviation(1) <= 2.0 * (30.0 + 1.0 + motion.body.radius) * (1 + 1e-12)


@pytest.mark.parametrize(
    "make, text",
    [
        (lambda: Joint.of("planar", -1, IDENTITY), "kind: 'planar'"),
        (lambda: Joint.of("revolute", -1, IDENTITY, (0, 0, 0)), "axis"),
        (lambda: JointStep([Joint.of("fixed", 0, IDENTITY)], (0,), (0,)), "the parent of joint 0"),
        (lambda: JointStep(arm("revolute"), (0, 1), (0,)), "start: expected"),
        (lambda: JointStep(arm("revolute"), (0,), (math.nan,)), "end: expected"),
    ],
)
def test_errors(make, text):
    with pytest.raises(ValueError, match=text):
        make()
