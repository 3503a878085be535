# SPDX-License-Identifier: Apache-2.0
"""No computed vertex is farther from the true one than the bound on rounding says."""

from fractions import Fraction

import numpy as np
import pytest
from oracle.rigid_queries import random_motion, random_paths
from random_poses import random_screw, true_vertices

from hpccd_core.rigid.body import Body
from hpccd_core.rigid.motion import Linear, ScrewMotion

LONG = np.longdouble
pytestmark = pytest.mark.skipif(np.finfo(LONG).eps > 1e-18, reason="no floats of 64 bits to compare with")


def worst(computed, true):
    return float(np.sqrt(((computed - true) ** 2).sum(axis=1)).max())


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("far", [0.0, 1.0, 1e6])
def test_vertices_of_a_screw(far, kind):
    rng = np.random.default_rng(5)
    ratios = []
    for angle in 10.0 ** rng.uniform(-16, 0.49, 150):
        screw = random_screw(rng, angle, far, way=10.0 ** rng.uniform(-6, 2))
        points = (10.0 ** rng.uniform(-2, 3) * rng.standard_normal((5, 3))).astype(kind)
        motion = ScrewMotion(Body.of(points), screw)
        for parts in (1, 7):
            for cut in range(parts + 1):
                true = true_vertices(screw, points, LONG(cut) / parts) + screw.start.shift
                error = worst(motion.vertices(cut, parts).astype(LONG), true)
                ratios.append(error / motion.rounding(parts))
    assert max(ratios) <= 1.0
    assert max(ratios) > 0.01  # a bound of any size would do else


def test_vertices_of_links():
    rng = np.random.default_rng(6)
    paths = random_paths(rng, 60, 3, np.ones(60), "joints")
    ratios = []
    for k in range(60):
        motion = random_motion(paths, k)
        for parts in (1, 3):
            for cut in range(parts + 1):
                true = paths.at(np.array([k]), np.array([LONG(cut) / parts]), LONG)[0][0]
                ratios.append(worst(motion.vertices(cut, parts).astype(LONG), true) / motion.rounding(parts))
    assert max(ratios) <= 1.0
    assert max(ratios) > 0.002


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_cuts_of_straight_lines(kind):
    rng = np.random.default_rng(7)
    start, end = (1e3 + rng.standard_normal((50, 3))).astype(kind), rng.standard_normal((50, 3)).astype(kind)
    motion = Linear(start, end)
    assert motion.rounding(1) == 0.0
    assert motion.vertices(0, 3) is start and motion.vertices(3, 3) is end
    for cut in (1, 2):
        for row, a, b in zip(motion.vertices(cut, 3).tolist(), start.tolist(), end.tolist(), strict=True):
            exact = [Fraction(x) + (Fraction(y) - Fraction(x)) * cut / 3 for x, y in zip(a, b, strict=True)]
            squared = sum((Fraction(x) - y) ** 2 for x, y in zip(row, exact, strict=True))
            assert squared <= Fraction(motion.rounding(3)) ** 2


def test_what_rests_is_exact():
    rest = np.ones((2, 3), np.float32)
    assert Linear(rest, rest).rounding(9) == 0.0
    assert Linear(rest, rest).vertices(4, 9) is rest
