# SPDX-License-Identifier: Apache-2.0
"""Separation of coordinates of all magnitudes: exact results, and no cliff.

slowest_separations.npz holds the slowest of two short searches by `python -m fuzz.slowest`, one of them with
exponents at most 200 apart.
"""

import time
from pathlib import Path

import numpy as np
import oracle
import pytest
from fuzz.generators import EDGE_EDGE, VERTEX_FACE
from single_pairs import KINDS, TEST

ORACLE = {VERTEX_FACE: oracle.separation_vertex_face, EDGE_EDGE: oracle.separation_edge_edge}
# Ten times what is promised, so that a slow machine does not fail; processor time, so that a busy one does not.
LIMITS = pytest.mark.parametrize(("span", "limit"), [("span 200", 10e-3), ("any", 200e-3)])


@pytest.fixture
def queries(kind, span):
    with np.load(Path(__file__).with_name("slowest_separations.npz")) as kept:
        return list(zip(kept[f"{span}|{kind}"], kept[f"{span}|{kind}|distances"].tolist(), strict=True))


@KINDS
@LIMITS
def test_results_and_time(kind, span, limit, queries):
    for points, distance in queries:
        seconds = []
        for _ in range(5):
            start = time.thread_time()
            (hit,), (toc,) = TEST[kind](points[None], "exact", minimum_separation=distance)
            seconds.append(time.thread_time() - start)
        (true_hit,), (true_toc,) = ORACLE[kind](points[None], distance)
        assert hit == true_hit and (not hit or abs(toc - true_toc) <= 1e-12)
        assert min(seconds) < limit
