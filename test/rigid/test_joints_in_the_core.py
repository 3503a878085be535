# SPDX-License-Identifier: Apache-2.0
"""Joints in the core: bit-identical to the oracle in Python, because replays compute recordings again."""

from concurrent.futures import ThreadPoolExecutor

import joints_oracle
import numpy as np
import pytest

from hpccd_core import InvalidArgument
from hpccd_core.joint_chains import JointBounds, JointChain, JointKind, placed
from hpccd_core.rigid.body import Body
from hpccd_core.rigid.joints import KINDS, Chain, Joint, JointStep, LinkMotion
from hpccd_core.rigid.transform import IDENTITY, Rigid

TREES = ("chain", "star", "tree")
SIZES = (1.0, 1e-160, 1e-9, 1e6, 1e140)


def random_rigid(rng, size):
    """One in four does not turn, one in four does not shift."""
    quaternion = rng.standard_normal(4) if rng.random() < 0.75 else [0.0, 0.0, 0.0, rng.choice([-1.0, 1.0])]
    shift = size * rng.standard_normal(3) if rng.random() < 0.75 else np.zeros(3)
    return Rigid.of(shift, quaternion / np.linalg.norm(quaternion))


def random_joints(rng, tree):
    joints = []
    for number in range(int(rng.integers(1, 14))):
        parent = {"chain": number - 1, "star": -1, "tree": int(rng.integers(-1, number))}[tree]
        origin = random_rigid(rng, rng.choice(SIZES, p=[0.6, 0.1, 0.1, 0.1, 0.1]))
        axis = rng.standard_normal(3) if rng.random() < 0.5 else np.eye(3)[rng.integers(3)]
        joints.append(Joint.of(str(rng.choice(KINDS)), parent, origin, axis))
    return joints


def random_values(rng, n):
    """Start and end: some joints rest, some turn against each other, some jump."""
    start = rng.uniform(-4, 4, n) * rng.choice([0.0, -0.0, 1.0, 1.0, 1e-300, 1e9], n)
    way = rng.uniform(-1, 1, n) * rng.choice(
        [0.0, 1e-12, 1e-3, 1.0, 1.0, 1e9, 1e50], n, p=[0.2, 0.1, 0.2, 0.2, 0.2, 0.05, 0.05]
    )
    if rng.random() < 0.3:
        way = np.where(np.arange(n) % 2, -1.0, 1.0) * rng.uniform(0, 1)
    return start, start + way


def random_body(rng):
    n = int(rng.integers(0, 5))
    return Body.of(rng.choice([0.0, 1e-9, 0.3, 1e3]) * rng.standard_normal((n, 3)) + rng.integers(0, 2, 3))


def same(a, b):
    """To the last bit, the signs of zeros too."""
    return np.asarray(a, np.float64).tobytes() == np.asarray(b, np.float64).tobytes()


@pytest.mark.parametrize("tree", TREES)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of the oracle: values may be as large as doubles hold
def test_poses_and_bounds_are_those_of_the_oracle(tree):
    for seed in range(100):
        rng = np.random.default_rng([seed, TREES.index(tree)])
        joints = random_joints(rng, tree)
        base = random_rigid(rng, rng.choice(SIZES))
        step = JointStep(joints, *random_values(rng, len(joints)), base)
        for t in (0.0, 0.3, 0.5, 1.0):
            values = step.end if t >= 1.0 else step.start + step.speed * t
            true = joints_oracle.poses(joints, values, base)
            assert same(step.pose_rows(t), [[*pose.quaternion, *pose.shift] for pose in true]), (seed, t)
        for link in range(len(joints)):
            body = random_body(rng)
            motion, exact = LinkMotion(step, link, body), joints_oracle.Link(step, link, body)
            for parts in (1, 3, 64):
                assert same(motion.deviation(parts), exact.deviation(parts)), (seed, link, parts)
                assert same(motion.rounding(parts), exact.rounding(parts)), (seed, link, parts)
                pose = step.poses(1 / parts)[link]
                assert same(motion.vertices(1, parts), pose.apply(body.vertices)), (seed, link, parts)


def test_the_sines_of_many_angles_are_those_of_python():
    """Asked for both at once, the C library may give other last bits."""
    angles = np.random.default_rng(1).uniform(-10, 10, 20_000)
    chain = Chain([Joint.of("revolute", -1, IDENTITY, (0, 0, 1))] * len(angles))
    found = chain.poses(angles, IDENTITY)
    true = joints_oracle.poses(chain.joints, angles, IDENTITY)
    assert same(found[:, :4], [pose.quaternion for pose in true])


def test_the_square_of_a_turn_is_that_of_python():
    """The power of two of the C library is not the product for one number in a thousand. Such turns, in the middle of
    the mesh, where they make up nearly all of the bound."""
    rng = np.random.default_rng(2)
    body = Body.of(np.concatenate([np.eye(3), -np.eye(3)]))
    joints = [Joint.of("revolute", number - 1, IDENTITY, (0, 0, 1)) for number in range(2)]
    for forth, back in rng.uniform(1e-4, 2e-4, (30_000, 2)).tolist():
        turn = joints_oracle.length((0.0, 0.0, forth - back))
        if turn * turn != turn**2:
            step = JointStep(joints, (0.0, 0.0), (forth, -back))
            assert same(LinkMotion(step, 1, body).deviation(1), joints_oracle.Link(step, 1, body).deviation(1))


def test_a_jump_beyond_all_squares_has_the_bound_of_the_robot():
    """Its square is no double."""
    step = JointStep([Joint.of("revolute", -1, IDENTITY)], (0.0,), (1e200,))
    body = Body.of(np.eye(3))
    assert 2.0 <= LinkMotion(step, 0, body).deviation(1) <= 2.0 * body.radius * (1 + 1e-12)


def test_links_without_vertices_and_robots_without_joints():
    joint = Joint.of("revolute", -1, IDENTITY)
    motion = LinkMotion(JointStep([joint], (0.0,), (1.0,)), 0, Body.of(np.empty((0, 3))))
    assert motion.vertices(1, 2).shape == (0, 3)
    assert motion.deviation(1) == 0.0
    assert placed(np.empty((0, 7)), [], np.empty((0, 3))).shape == (0, 3)
    assert Chain([]).poses(np.empty(0), IDENTITY).shape == (0, 7)


def test_threads_may_share_a_step():
    """Of many vertices too, for which the interpreter lock is released."""
    rng = np.random.default_rng(3)
    joints = [Joint.of("revolute", number - 1, random_rigid(rng, 1.0), (0, 0, 1)) for number in range(12)]
    step = JointStep(joints, np.zeros(12), np.ones(12))
    body = Body.of(rng.standard_normal((20_000, 3)))

    def computed(link):
        motion = LinkMotion(step, link, body)
        return motion.deviation(2), motion.rounding(2), motion.vertices(1, 2)

    alone = [computed(link) for link in range(12)]
    with ThreadPoolExecutor(4) as pool:
        for k, (deviation, rounding, vertices) in enumerate(pool.map(computed, [*range(12)] * 8)):
            assert (deviation, rounding) == alone[k % 12][:2] and same(vertices, alone[k % 12][2])


@pytest.mark.parametrize(
    "make, text",
    [
        (lambda: JointChain([JointKind.fixed], [0], np.zeros((1, 11))), "parents: that of joint 0 is 0"),
        (lambda: JointChain([JointKind.fixed], [-1], np.zeros((2, 11))), "kinds, parents, numbers"),
        (lambda: JointChain([JointKind.fixed], [-1], np.zeros(10)), "numbers: expected rows of 11"),
        (lambda: Chain([Joint.of("fixed", -1, IDENTITY)]).poses(np.zeros(2), IDENTITY), "values: expected 1"),
        (
            lambda: LinkMotion(JointStep([], (), ()), 0, Body.of(np.eye(3))).deviation(1),
            "link: 0; there are 0 joints",
        ),
        (lambda: placed(np.zeros((1, 7)), [(1, 3)], np.eye(3)), "a link that has no pose"),
        (lambda: placed(np.zeros((1, 7)), [(0, 2)], np.eye(3)), "vertices: expected as many"),
        (lambda: placed(np.zeros((1, 7)), [(0, 3), (0, 1)], np.eye(3)), "out of order"),
        (lambda: placed(np.zeros((1, 7)), [(0, 4)], np.eye(3)), "out of order"),
    ],
)
def test_what_the_core_rejects(make, text):
    with pytest.raises(InvalidArgument, match=text):
        make()


def test_bounds_of_no_chain_are_rejected():
    with pytest.raises(TypeError, match="incompatible"):
        JointBounds(None, np.zeros(0), np.zeros(0), IDENTITY.quaternion, IDENTITY.shift)
