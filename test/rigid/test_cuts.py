# SPDX-License-Identifier: Apache-2.0
"""A step is cut into the fewest parts that keep the deviation within the tolerance."""

import itertools

import numpy as np
import pytest
from random_poses import random_screw

from hpccd_core.rigid.body import Body
from hpccd_core.rigid.cuts import Margin, all_grown, bound, fewest_parts, grown
from hpccd_core.rigid.motion import Linear, ScrewMotion

POINTS = np.random.default_rng(1).standard_normal((20, 3))


def moved(angle, size=1.0, seed=2):
    return ScrewMotion(Body.of(size * POINTS), random_screw(np.random.default_rng(seed), angle))


def test_the_fewest():
    for seed, (angle, tolerance) in enumerate((a, t) for a in (0.01, 0.3, 3.1) for t in 10.0 ** np.linspace(-7, 1, 40)):
        motion = moved(angle, seed=seed)
        cut = fewest_parts([motion], tolerance, 100_000)
        assert cut.enough and motion.deviation(cut.parts) <= tolerance
        assert cut.parts == 1 or motion.deviation(cut.parts - 1) > tolerance


def test_more_than_are_allowed_are_not_made():
    cut = fewest_parts([moved(3.0)], 1e-9, 8)
    assert (cut.parts, cut.enough) == (8, False)
    assert cut.deviation == moved(3.0).deviation(8) > 1e-9


def test_all_meshes_are_cut_as_the_one_that_needs_most():
    motions = [moved(0.1), moved(2.0, 5.0), Linear(POINTS, POINTS + 1.0)]
    cut = fewest_parts(motions, 1e-3, 10_000)
    assert cut.parts == fewest_parts(motions[1:2], 1e-3, 10_000).parts > fewest_parts(motions[:1], 1e-3, 10_000).parts
    assert fewest_parts([], 1e-3, 4).parts == 1


def test_a_tolerance_below_rounding_is_never_reached():
    assert not fewest_parts([moved(1.0)], 1e-18, 1 << 20).enough


def test_errors():
    with pytest.raises(ValueError, match="tolerance"):
        fewest_parts([], 0.0, 4)
    with pytest.raises(ValueError, match="most"):
        fewest_parts([], 1.0, 0)
    with pytest.raises(ValueError, match=r"start, end: .* got \(20, 3\) and \(1, 3\)"):
        Linear(POINTS, POINTS[:1])
    with pytest.raises(TypeError, match="start, end: expected arrays"):
        Linear([[0.0, 0.0, 0.0]], POINTS[:1])
    with pytest.raises(ValueError, match="margins: 1 for separations of shape"):
        all_grown(np.zeros((2, 2)), [Margin(1.0, 0.0)])


def test_separation_grows_by_both_sides_and_upwards():
    margins = Margin(1e-3, 1e-15), Margin(2e-3, 0.0)
    assert 0.003 + 1e-15 < bound(margins) < 0.003 + 1e-14
    assert grown(0.1, *margins) >= 0.1 + bound(margins)
    resting = Margin.of(Linear(POINTS, POINTS), 5)
    assert grown(0.1, resting, resting) == 0.1


def test_all_pairs_at_once_grow_as_each_alone():
    random = np.random.default_rng(3)
    deviations = random.choice([0.0, 1e-3, 7e-160, 3e5], 40) * random.random(40)
    roundings = 1e-16 * random.random(40) ** 9
    margins = [Margin(*pair) for pair in zip(deviations.tolist(), roundings.tolist(), strict=True)]
    margins += [Margin(0.0, 0.0)] * 2
    asked = random.choice([0.0, 0.01, 1e-300, 2.5], (42, 42))
    asked = np.maximum(asked, asked.T)
    table = all_grown(asked, margins)
    for a, b in itertools.product(range(42), repeat=2):
        assert table[a, b] == (grown(asked[a, b], margins[a], margins[b]) if a != b else asked[a, b])
