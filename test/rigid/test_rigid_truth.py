# SPDX-License-Identifier: Apache-2.0
"""The oracle says what is known by hand."""

import numpy as np
import pytest
from oracle.rigid_paths import ScrewPaths
from oracle.rigid_truth import BEYOND, OPEN, WITHIN, Pairs, comes_within
from random_poses import quaternion


def paths(points, start, end, shifts):
    points = np.array([points], float)
    return ScrewPaths(points, np.array([[start, end]], float), np.array([shifts], float), np.zeros((1, 3)))


def turning_vertex():
    """A point at the distance 1 from the z axis turns by 2 radians; a wall at x = 2 rests."""
    still = quaternion((0, 0, 1), 0)
    a = paths([[np.cos(-1), np.sin(-1), 0]], still, quaternion((0, 0, 1), 2.0), np.zeros((2, 3)))
    b = paths([[2, -9, -9], [2, 9, -9], [2, 0, 9]], still, still, np.zeros((2, 3)))
    return Pairs(a, b, "vf")


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, 1e-12, 3e-14])
def test_nearest_in_the_middle_of_a_turn(gap):
    pairs = turning_vertex()
    assert comes_within(pairs, np.array([1 + gap])) == [WITHIN]
    assert comes_within(pairs, np.array([1 - gap])) == [BEYOND]


def test_what_cannot_be_told_is_left_open():
    assert comes_within(turning_vertex(), np.array([1.0])) == [OPEN]


def test_until_a_time():
    pairs = turning_vertex()
    early = np.array([1.2])
    when = (np.arccos(0.8) * -1 + 1) / 2  # 2 - cos = 1.2
    assert comes_within(pairs, early, until=np.array([when + 1e-9])) == [WITHIN]
    assert comes_within(pairs, early, until=np.array([when - 1e-9])) == [BEYOND]


def test_edges_that_pass_each_other():
    """One along x rests; one along y goes down past its end, 0.5 beside it."""
    still = quaternion((0, 0, 1), 0)
    a = paths([[-1, 0, 0], [1, 0, 0]], still, still, np.zeros((2, 3)))
    b = paths([[1.5, -1, 0], [1.5, 1, 0]], still, still, [[0, 0, 1], [0, 0, -1]])
    pairs = Pairs(a, b, "ee")
    assert comes_within(pairs, np.array([0.5 + 1e-9])) == [WITHIN]
    assert comes_within(pairs, np.array([0.5 - 1e-9])) == [BEYOND]


def test_velocities_are_the_slopes_of_positions_and_accelerations_bound_theirs():
    from oracle.rigid_queries import random_queries

    for motion in ("screws", "joints"):
        queries = random_queries(np.random.default_rng(1), 200, "ee", motion)
        rows, h = np.arange(200), np.longdouble(1e-5)
        for side in (queries.pairs.a, queries.pairs.b):
            for t in (0.1, 0.5, 0.9):
                middle = np.full(200, t, np.longdouble)
                (x0, v0), (x1, v1) = (side.at(rows, middle + k * h, np.longdouble) for k in (-1, 1))
                _, v = side.at(rows, middle, np.longdouble)
                scale = side.size()[:, None, None]
                assert (np.abs((x1 - x0) / (2 * h) - v) / scale).max() < 1e-7
                bend = np.linalg.norm(((v1 - v0) / (2 * h)).astype(float), axis=2).max(axis=1)
                assert (bend <= side.acceleration() + 1e-7 * side.size()).all()
