# SPDX-License-Identifier: Apache-2.0
"""Random pairs of features under random screws and joint motions: none missed, none late, none beyond twice the bound.

`make bench BENCH_ARGS=rigid` asks a hundred thousand of each.
"""

import numpy as np
import pytest
from oracle import rigid_results
from oracle.rigid_queries import KINDS, MOTIONS, random_queries
from oracle.rigid_results import ask, judge


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("motion", MOTIONS)
def test_results_against_the_truth(motion, kind):
    queries = random_queries(np.random.default_rng(11), 500, kind, motion)
    verdict = judge(queries, ask(queries))
    assert verdict.right, verdict
    assert min(verdict.touching, verdict.apart, verdict.excess) > 100
    assert 1.0 < verdict.worst_excess <= 2.0  # over the bound


def test_a_bound_that_is_too_small_is_found_out(monkeypatch):
    """With a tenth of it left out some are missed: the queries come so near."""
    monkeypatch.setattr(rigid_results, "grown", lambda d, a, b: d + 0.9 * (a.sum + b.sum))
    queries = random_queries(np.random.default_rng(12), 500, "vf", "screws")
    assert judge(queries, ask(queries)).missed > 0
