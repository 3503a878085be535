# SPDX-License-Identifier: Apache-2.0
"""Normals, points and nearest points with a separation are those of the motion as given, however short the gap."""

from fractions import Fraction

import exact_geometry
import numpy as np
import pytest
import single_pairs
from fuzz.generators import EDGE_EDGE, VERTEX_FACE
from single_pairs import KINDS, TEST

import hpccd_core as hc

SEPARATIONS = [1e-300, 1e-60, 1e-18, 1e-15, 1e-14, 1e-12, 1e-9, 1e-6, 1e-3]


def normal_of(kind, query, d):
    found = single_pairs.detector(kind, minimum_separation=d)
    return single_pairs.contact(found, kind, np.asarray(query, float))


def assert_along(normal, expected, tolerance=1e-6):
    np.testing.assert_allclose(normal, expected, rtol=0, atol=tolerance)


def ordinary(queries):
    return queries


def squeezed(queries):
    """Needles and slivers, and short motions."""
    return queries * np.random.default_rng(2).choice([1, 1e-2, 1e-4], (len(queries), 1, 3))


CHANGES = [ordinary, squeezed, lambda x: x * 2.0**-300, lambda x: x * 2.0**200, lambda x: x + 1000]


def touching(kind, change, number):
    """Queries that touch, each by a rotation of its own, and the times."""
    rng = np.random.default_rng(1)
    queries = change(single_pairs.contacts(kind, single_pairs.small_steps, number))
    queries = np.array([query @ np.linalg.qr(rng.normal(size=(3, 3)))[0] for query in queries])
    hit, toc = TEST[kind](queries)
    return zip(queries[hit], toc[hit], strict=True)


@KINDS
@pytest.mark.parametrize("change", CHANGES, ids=["ordinary", "squeezed", "tiny", "huge", "far away"])
def test_normals_of_features_that_pass_through_each_other(kind, change):
    seen = 0
    for i, (query, at) in enumerate(touching(kind, change, 36)):
        size = np.abs(query - query.mean((0, 1))).max()
        relative = SEPARATIONS[i % len(SEPARATIONS)]
        d = max(relative * size, 5e-324)
        if relative < 1e-10:
            # The gap is as long as d just before they touch, in the interior of both, except by a chance of 1e-10.
            expected, tolerance = exact_geometry.normal_before_contact(kind, query, at), 1e-6
        else:
            before = TEST[kind](query[None], minimum_separation=d)[1][0]
            if before == 0:
                continue
            expected = exact_geometry.direction_of_gap(kind, query, d, before, at)
            tolerance = 1e-5 + 1e-12 * np.abs(query[4:] - query[:4]).max() / d  # by the rounding of toc
        if expected is not None:
            seen += 1
            assert_along(normal_of(kind, query, d)[2], expected, tolerance)
    assert seen > 10


# Integer matrices of vectors at right angles and of one length.
TURNS = [np.eye(3), np.array([[3, 4, 0], [-4, 3, 0], [0, 0, 5]]), np.array([[1, 2, 2], [2, 1, -2], [2, -2, 1]])]
FLOOR = [(-4, -4, 0), (4, -4, 0), (0, 4, 0)]
ROD = [(-2, 0, 0), (2, 0, 0)]
MEETINGS = {
    "vertex, inside of a face": (VERTEX_FACE, [(0, 0, 2), *FLOOR], (1, 3, -4)),
    "vertex, border of a face from beside": (VERTEX_FACE, [(1, -6, 0), *FLOOR], (1, 4, 0)),
    "vertex, border of a face from above": (VERTEX_FACE, [(1, -4, 2), *FLOOR], (0, 0, -4)),
    "vertex, border of a face at an angle": (VERTEX_FACE, [(1, -6, 2), *FLOOR], (0, 4, -4)),
    "vertex, corner of a face": (VERTEX_FACE, [(5, -5, 1), *FLOOR], (-2, 2, -2)),
    "crossing edges": (EDGE_EDGE, [*ROD, (0, -2, 2), (1, 2, 2)], (0, 0, -4)),
    "end of an edge, inside of another": (EDGE_EDGE, [*ROD, (1, 0, 2), (1, 3, 4)], (0, 0, -4)),
    "end of an edge at an angle, inside of another": (EDGE_EDGE, [*ROD, (1, 1, 2), (1, 3, 4)], (0, -2, -4)),
    "ends of edges": (EDGE_EDGE, [*ROD, (3, 1, 1), (5, 3, 3)], (-2, -2, -2)),
    "parallel edges": (EDGE_EDGE, [*ROD, (-1, 1, 2), (5, 1, 2)], (0, -2, -4)),
    "edges on one line": (EDGE_EDGE, [*ROD, (3, 0, 0), (7, 0, 0)], (-2, 0, 0)),
}


def meeting(start, way, turn):
    """The first feature rests where the others are moved away from it, half of the way at t=1/2."""
    end = np.array(start, float)
    moved = 1 if len(start) == 4 and start[1:] == FLOOR else 2
    rows = [0] if moved == 1 else [2, 3]
    end[rows] += way
    return np.concatenate([np.array(start, float) @ turn.T, end @ turn.T])


@pytest.mark.parametrize("name", MEETINGS)
@pytest.mark.parametrize("d", [1e-300, 1e-40, 1e-15])
def test_normals_of_features_that_meet_exactly(name, d):
    kind, start, way = MEETINGS[name]
    for turn in TURNS:
        query = meeting(start, way, turn)
        now = exact_geometry.positions(query, Fraction(1, 2))
        assert not any(exact_geometry.gap(kind, now)), "they touch at t = 1/2"
        expected = exact_geometry.unit(
            exact_geometry.gap(kind, exact_geometry.positions(query, Fraction(1, 2) - Fraction(1, 2**60)))
        )
        toc, point, normal = normal_of(kind, query, d)
        assert_along(normal, expected, 1e-9)
        assert 0.5 - 1e-12 <= toc <= 0.5
        assert np.abs(point - [float(x) for x in now[0 if kind == VERTEX_FACE else 2]]).max() < 60


@pytest.mark.parametrize("exponent", [-30, -60, -100, -900])
@pytest.mark.parametrize(("offset", "height"), [(0.5, 0.75**0.5), (-0.5, 1.0), (0.0, 1.0), (0.96875, 0.248039185412)])
def test_normals_of_features_that_pass_beside_each_other(exponent, offset, height):
    # At d = 2^exponent, and the border in between: the direction turns in far less time than toc is known to.
    d = 2.0**exponent
    aside = max(offset, 0)
    face = [(-4, -4, 0), (0, -4, 0), (0, 4, 0)]
    vertex = [(offset * d, 0, 1), *face], [(offset * d, 0, -1), *face]
    assert_along(normal_of(VERTEX_FACE, np.concatenate(vertex), d)[2], (aside, 0, height))
    rod = [(0, -1, 0), (0, 1, 0)]
    upright = [(offset * d, 0, 1), (offset * d + 1, 0, 3)], [(offset * d, 0, -1), (offset * d + 1, 0, 1)]
    if offset >= 0:
        normal = normal_of(EDGE_EDGE, np.concatenate([rod, upright[0], rod, upright[1]]), d)[2]
        assert_along(normal, (aside, 0, height))
    corner = [(-4, -1, 0), (0, 0, 0), (-4, 1, 0)]
    vertex = [(offset * d, 0, 1), *corner], [(offset * d, 0, -1), *corner]
    assert_along(normal_of(VERTEX_FACE, np.concatenate(vertex), d)[2], (aside, 0, height))


@KINDS
def test_normals_of_short_gaps_at_the_start(kind):
    # The rounding of points is as large as the gap.
    rng = np.random.default_rng(2)
    for exponent in (-45, -50, -51):
        for _ in range(20):
            corners = rng.integers(-99, 100, (4, 3)) * 0.01
            if kind == VERTEX_FACE:
                corners[0] = corners[1:].mean(axis=0)
            else:
                corners[2:] += corners[:2].mean(axis=0) - corners[2:].mean(axis=0)
            corners[0, 0] += 2.0**exponent
            query = np.concatenate([corners, corners])
            gap = exact_geometry.gap(kind, exact_geometry.positions(query, 0))
            if any(gap):
                toc, _, normal = normal_of(kind, query, 1e-3)
                assert toc == 0
                assert_along(normal, exact_geometry.unit(gap), 1e-9)


@KINDS
def test_normals_of_denormal_gaps(kind):
    """Positions are rounded to multiples of 2^-1074, which is as much as the length of these gaps."""
    queries = np.random.default_rng(5).integers(-20, 21, (400, 8, 3)).astype(float)
    near = queries[TEST[kind](queries, minimum_separation=1.0)[0]]
    assert len(near) > 30
    for query in near:
        _, _, expected = normal_of(kind, query, 1.0)
        assert_along(normal_of(kind, query * 2.0**-1074, 2.0**-1074)[2], expected)


def test_what_touches_at_the_start_has_the_normal_of_plain_contact():
    floor = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    toc, _, normal = normal_of(VERTEX_FACE, [(0.25, 0.25, 0), *floor, (0.25, 0.25, -1), *floor], 1e-300)
    assert toc == 0
    np.testing.assert_array_equal(normal, (0, 0, 1))


def side_by_side(rng, n):
    """Edges from 0 to 4 and from 1 to 7 along one direction that pass through each other."""
    found = []
    while len(found) < n:
        u, v = rng.integers(-5, 6, (2, 3)).astype(float)
        across = np.cross(u, v)
        if np.count_nonzero(u) > 1 and across.any():
            edges = np.array([0 * u, 4 * u, u, 7 * u])
            edges[2:] += 4 * across
            found.append((edges, edges - np.array([0, 0, 8, 8])[:, None] * across))
    return found


def turning_together(rng, n):
    """The same with a direction that changes along the way."""
    found = []
    for start, end in side_by_side(rng, n):
        by = rng.integers(-2, 3, 3).astype(float)
        other = np.linalg.norm(np.cross(start[1], start[1] + 4 * by)) > 0
        found.append((start, end + np.array([0, 4, 1, 7])[:, None] * by) if other else (start, end))
    return found


@pytest.mark.parametrize("motions", [side_by_side, turning_together])
@pytest.mark.parametrize("d", [0.0, 1e-14, 0.25])
def test_places_of_edges_that_stay_parallel(motions, d):
    scene = hc.Scene()
    for name in "ab":
        scene.add_mesh(name, edges=[[0, 1]])
    detector = hc.Detector(scene, threads=1, minimum_separation=d, outputs=("points", "closest"), backend="cpu")
    for start, end in motions(np.random.default_rng(3), 150):
        found = detector.detect(start, end)
        if motions is turning_together and len(found) == 0:
            continue
        assert found.ee.tolist() == [[0, 1, 2, 3]]
        now = np.array(exact_geometry.positions(np.concatenate([start, end]), found.ee_toc[0]), float)
        along = (now[1] - now[0]) / np.linalg.norm(now[1] - now[0])
        ends = np.sort(now[2:] @ along)
        middle = (max(now[0] @ along, ends[0]) + min(now[1] @ along, ends[1])) / 2
        size = np.abs(now).max()
        for place in (found.points[0], *found.closest[0]):
            assert abs(place @ along - middle) < 1e-6 * size
