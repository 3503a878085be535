# SPDX-License-Identifier: Apache-2.0
"""The elementary tests against the exact oracle, one query at a time, shrunk by hypothesis where they differ."""

import hypothesis.strategies as st
import numpy as np
import oracle
import pytest
from fuzz.disturbances import disturb
from fuzz.generators import EDGE_EDGE, GENERATORS, VERTEX_FACE
from hypothesis import example, given, settings
from hypothesis.extra.numpy import arrays

import hpccd_core as hc

CORE = {VERTEX_FACE: hc.test_vertex_face, EDGE_EDGE: hc.test_edge_edge}
ORACLE = {VERTEX_FACE: oracle.vertex_face, EDGE_EDGE: oracle.edge_edge}
ACCURACIES = ("fast", "balanced", "conservative", "exact")
KINDS = pytest.mark.parametrize("kind", [VERTEX_FACE, EDGE_EDGE])
PROMISING = ("exact", "conservative")


def assert_promises_kept(kind, queries):
    true_hit, true_toc = ORACLE[kind](queries)
    for accuracy in PROMISING:
        hit, toc = CORE[kind](queries, accuracy=accuracy)
        assert not (true_hit & ~hit).any(), f"{accuracy} missed: {queries[true_hit & ~hit][0].tolist()}"
        both = hit & true_hit
        if accuracy == "exact":
            assert not (hit & ~true_hit).any(), f"invented: {queries[hit & ~true_hit][0].tolist()}"
            assert np.abs(toc[both] - true_toc[both]).max(initial=0) <= 1e-12
            assert np.isposinf(toc[~hit]).all()
        else:
            assert (toc[both] <= true_toc[both]).all(), "later than the contact"
        assert ((toc[hit] >= 0) & (toc[hit] <= 1)).all()


@st.composite
def degenerate_queries(draw):
    """Few values, then what makes it worse: coincident points, a shared plane or line, no motion, an ulp, a scale."""
    q = draw(arrays(np.float64, (8, 3), elements=st.sampled_from([-2.0, -1.0, 0.0, 0.5, 1.0, 2.0])))
    points = st.integers(0, 3)
    for source, target in draw(st.lists(st.tuples(points, points), max_size=2)):
        half = draw(st.sampled_from([slice(0, 4), slice(4, 8)]))
        q[half][target] = q[half][source]
    if draw(st.booleans()):
        q[:, draw(st.integers(0, 2))] = 0.0
    if draw(st.booleans()):
        still = draw(st.sampled_from([[0], [1, 2, 3], [0, 1], [2, 3], [0, 1, 2, 3]]))
        q[4:][still] = q[:4][still]
    factor = draw(st.sampled_from([1.0, 3.0, 2.0**-100, 2.0**100, 1e-30, 1e30, 2.0**-1060, 1e100]))
    shift = draw(st.sampled_from([0.0, 1.0, 2.0**40, -1e12]))
    q = factor * (q + shift)
    for row, axis, towards in draw(
        st.lists(st.tuples(st.integers(0, 7), st.integers(0, 2), st.sampled_from([-np.inf, np.inf])), max_size=2)
    ):
        q[row, axis] = np.nextafter(q[row, axis], towards)
    return q[None]


FALLING_ON_A_CORNER = np.array(
    [[[0, 0, 1], [0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, -1], [0, 0, 0], [1, 0, 0], [0, 1, 0]]], float
)
ALL_IN_ONE_POINT = np.ones((1, 8, 3))


@KINDS
@settings(max_examples=400)
@given(queries=degenerate_queries())
@example(queries=FALLING_ON_A_CORNER)
@example(queries=ALL_IN_ONE_POINT)
@example(queries=np.zeros((1, 8, 3)))
def test_degenerate_query(kind, queries):
    assert_promises_kept(kind, queries)


@KINDS
@settings(max_examples=100)
@given(queries=arrays(np.float64, (1, 8, 3), elements=st.floats(-1e150, 1e150, allow_nan=False)))
def test_any_finite_query(kind, queries):
    assert_promises_kept(kind, queries)


@KINDS
@settings(max_examples=100)
@given(queries=arrays(np.float32, (1, 8, 3), elements=st.floats(allow_nan=False, allow_infinity=False, width=32)))
def test_float32_query(kind, queries):
    assert_promises_kept(kind, queries)
    for accuracy in PROMISING:
        for a, b in zip(CORE[kind](queries, accuracy), CORE[kind](queries.astype(float), accuracy), strict=True):
            assert np.array_equal(a, b)


@KINDS
@pytest.mark.parametrize("generator", GENERATORS[VERTEX_FACE])
def test_generated_queries(kind, generator):
    rng = np.random.default_rng(1)
    queries = GENERATORS[kind][generator](rng, 500)
    assert_promises_kept(kind, queries)
    assert_promises_kept(kind, disturb(rng, queries, kind))


@KINDS
@pytest.mark.parametrize("scale", [1e-30, 1e-10, 1e10, 1e30])
@pytest.mark.parametrize("offset", [0.0, 1.0, 1e6, 1e12])
def test_scale_and_offset(kind, scale, offset):
    queries = GENERATORS[kind]["meeting"](np.random.default_rng(2), 300)
    assert_promises_kept(kind, scale * (queries + offset))


@KINDS
@pytest.mark.parametrize("exponent", [-1074, -1070, -1030, -600, 400, 480])
def test_denormal_and_huge_coordinates(kind, exponent):
    queries = GENERATORS[kind]["meeting"](np.random.default_rng(3), 300)
    assert_promises_kept(kind, queries * 2.0**exponent)


@pytest.mark.parametrize("scale", [2.0**51, 2.0**76, 2.0**100])
def test_smallest_number_beside_large_ones(scale):
    """Off by the smallest number at the start, which must not vanish when the rest is brought to integers."""
    start = [[-1, -1, 0], [-1, -1, 0], [1, -1, 1], [-1, 0, -1]]
    corner = scale * np.array([[*start, [1, 0, 0], [1, -1, 0], [-1, 0, 0], [1, 1, -1]]], float)
    corner[0, 0, 2] = 5e-324
    assert_promises_kept(VERTEX_FACE, corner)
    start = [[0, -1, 0], [0, 1, 0], [0, 2, 3], [0, -1, 0]]
    ends = scale * np.array([[*start, [-1, 0, -3], [0, -1, -2], [0, -1, -3], [-1, 0, -4]]], float)
    ends[0, 0, 0] = 1e-323
    assert_promises_kept(EDGE_EDGE, ends)


@KINDS
@pytest.mark.parametrize("accuracy", ACCURACIES)
def test_every_tier_results_with_a_time_in_the_unit_interval(kind, accuracy):
    for generator in GENERATORS[kind].values():
        rng = np.random.default_rng(4)
        hit, toc = CORE[kind](disturb(rng, generator(rng, 300), kind), accuracy)
        assert ((toc[hit] >= 0) & (toc[hit] <= 1)).all()
        assert np.isposinf(toc[~hit]).all()


@KINDS
@pytest.mark.parametrize(("accuracy", "share", "toc_error"), [("fast", 2e-3, 1e-3), ("balanced", 0.0, 1e-9)])
def test_tiers_without_promise_err_little_where_nothing_is_degenerate(kind, accuracy, share, toc_error):
    queries = GENERATORS[kind]["generic"](np.random.default_rng(6), 20_000)
    true_hit, true_toc = ORACLE[kind](queries)
    hit, toc = CORE[kind](queries, accuracy)
    assert (hit != true_hit).mean() <= share
    both = hit & true_hit
    assert both.sum() > 100
    assert np.quantile(np.abs(toc[both] - true_toc[both]), 0.99) <= toc_error


@KINDS
@pytest.mark.parametrize("accuracy", ACCURACIES)
@pytest.mark.parametrize("simd", ["avx2", "avx512", "neon"])
def test_instruction_sets_agree_to_the_bit(kind, accuracy, simd):
    rng = np.random.default_rng(7)
    queries = np.concatenate([disturb(rng, g(rng, 301), kind) for g in GENERATORS[kind].values()])
    try:
        wide = CORE[kind](queries, accuracy, simd=simd)
    except ValueError as error:
        pytest.skip(str(error))
    for a, b in zip(wide, CORE[kind](queries, accuracy, simd="scalar"), strict=True):
        assert np.array_equal(a, b)


@KINDS
@pytest.mark.parametrize("accuracy", ACCURACIES)
def test_results_do_not_depend_on_neighbours_in_the_batch(kind, accuracy):
    rng = np.random.default_rng(8)
    queries = np.concatenate([disturb(rng, g(rng, 20), kind) for g in GENERATORS[kind].values()])
    hit, toc = CORE[kind](queries, accuracy)
    for i, query in enumerate(queries):
        alone = CORE[kind](query[None], accuracy)
        assert (alone[0][0], alone[1][0]) == (hit[i], toc[i])


@KINDS
def test_no_queries(kind):
    hit, toc = CORE[kind](np.empty((0, 8, 3)))
    assert hit.shape == toc.shape == (0,)
    assert hit.dtype == bool and toc.dtype == np.float64
