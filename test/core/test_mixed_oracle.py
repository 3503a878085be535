# SPDX-License-Identifier: Apache-2.0
"""The oracle of mixed scenes against rational numbers and cases that can be checked by hand."""

from fractions import Fraction

import numpy as np
import pytest
from fuzz.mixed_scenes import MIXED_SCENES, TOPOLOGIES
from oracle import mixed
from oracle.mixed import Filters, MixedMesh, MixedScene, Values

NO_FACES = np.empty((0, 3), int)
SHEET = np.array([[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4]])  # three rows of two vertices


def exact(x):
    return [Fraction(float(c)) for c in x]


def points_meet(start, end, separation):
    """Two moving points, (2,3) at both ends: the earliest time within the separation, as a pair of bounds 1e-30 apart,
    or None."""
    a, b = ([y - x for x, y in zip(exact(points[0]), exact(points[1]), strict=True)] for points in (start, end))
    by = [y - x for x, y in zip(a, b, strict=True)]
    limit = Fraction(float(separation)) ** 2

    def excess(t):
        return sum((x + t * d) ** 2 for x, d in zip(a, by, strict=True)) - limit

    if excess(0) <= 0:
        return Fraction(0), Fraction(0)
    speed = sum(d * d for d in by)
    if speed == 0:
        return None
    nearest = min(max(-sum(x * d for x, d in zip(a, by, strict=True)) / speed, Fraction(0)), Fraction(1))
    if excess(nearest) > 0:
        return None
    low, high = Fraction(0), nearest
    while high - low > Fraction(1, 10**30):
        middle = (low + high) / 2
        low, high = (middle, high) if excess(middle) > 0 else (low, middle)
    return low, high


def test_two_moving_points_meet_when_their_quadratic_says_so():
    rng = np.random.default_rng(45)
    scene = MixedScene([MixedMesh(NO_FACES, 2, points=True)])
    met = 0
    for _ in range(400):
        t0, t1 = rng.integers(-4, 5, (2, 2, 3)) * (1.0 if rng.random() < 0.5 else rng.random())
        if rng.random() < 0.3:
            t1[:, 0] = t0[:, 0]
        thickness = rng.choice([0.0, 0.25, 1.0, 2.5, float(rng.random())], 2)
        values = Values(np.empty((0, 4)), np.full((1, 1), 0.5), [thickness])
        rows, toc = scene.contacts(t0, t1, values)["vv"]
        known = points_meet(t0, t1, 0.5 + (thickness[0] + thickness[1]))
        assert (known is not None) == (len(rows) == 1)
        if known is not None:
            met += known[0] > 0
            assert known[0] - Fraction(1, 10**15) <= Fraction(float(toc[0])) <= known[1]
    assert met > 40


def test_a_vertex_meets_a_plane_when_its_height_says_so():
    for scale in (1.0, 2.0**-900, 2.0**400):
        plane = np.array([3.0, 0, 4, 5 * scale])  # of length 5
        start, end = np.array([0, 0, 5.0]) * scale, np.array([0, 0, 0.0])
        assert mixed.plane_time(start, end, plane, 0.0) == 0.75
        assert mixed.plane_time(start, end, plane, scale) == 0.5
        assert mixed.plane_time(start, end, plane, 3 * scale) == 0.0
        assert mixed.plane_time(start, start, plane, 2.9 * scale) == np.inf
        assert mixed.plane_distance(start, plane) == 3 * scale and mixed.plane_distance(end, plane) == -scale
    assert mixed.plane_time(np.array([0, 0, 1.0]), np.zeros(3), np.array([1.0, 1, 1, 0]), 0.0) == 1.0
    # A third is not a double: rounded down.
    third = mixed.plane_time(np.array([0, 0, 1.0]), np.array([0, 0, -2.0]), np.array([0, 0, 1.0, 0]), 0.0)
    assert Fraction(third) <= Fraction(1, 3) < Fraction(float(np.nextafter(third, 1)))


def test_edges_and_vertices_have_the_greatest_thickness_of_their_faces():
    scene = MixedScene(
        [MixedMesh(SHEET, 6), MixedMesh(NO_FACES, 3, np.array([[0, 1], [2, 1]])), MixedMesh(NO_FACES, 2)]
    )
    values = Values(np.empty((0, 4)), np.zeros((3, 3)), [[1, 2, 3, 4], [5, 6], [7, 8]])
    of_vertex, of_edge, of_face = scene.thickness_of(values)
    assert of_vertex.tolist() == [2, 1, 4, 3, 4, 4, 5, 6, 6, 7, 8] and of_face.tolist() == [1, 2, 3, 4]
    edges = dict(zip(map(tuple, scene.edges.tolist()), of_edge.tolist(), strict=True))
    assert edges[0, 1] == 1 and edges[0, 3] == 2 and edges[2, 3] == 3 and edges[2, 4] == 4
    assert edges[6, 7] == 5 and edges[7, 8] == 6


def test_points_meet_points_and_edges_of_no_face_and_faces():
    scene = MixedScene(
        [
            MixedMesh(SHEET, 7, np.array([[4, 6]]), points=True),
            MixedMesh(NO_FACES, 2, points=True, self_collision=False),
            MixedMesh(NO_FACES, 1),
        ]
    )
    assert scene.points.tolist() == [7, 8]
    assert scene.pairs["vv"].rows.tolist() == []
    assert scene.pairs["ve"].rows.tolist() == [[7, 4, 6], [8, 4, 6]]
    assert {v for v, _ in scene.pairs["vf"].rows.tolist()} == set(range(10))


@pytest.mark.parametrize("rings", [0, 1, 2, 3])
def test_rings_count_edges_between_vertices(rings):
    rope = MixedMesh(NO_FACES, 8, np.stack([np.arange(7), np.arange(1, 8)], axis=1))
    rows = MixedScene([rope], filters=Filters(rings={0: rings})).pairs["ee"].rows
    assert rows.tolist() == [[i, i + 1, j, j + 1] for i in range(7) for j in range(i + 2 + rings, 7)]


def test_other_filters():
    x = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0], [1, 2, 0]], float)
    every = {tuple(row) for row in MixedScene([MixedMesh(SHEET, 6)]).pairs["ee"].rows.tolist()}

    def left(filters):
        return {tuple(row) for row in MixedScene([MixedMesh(SHEET, 6)], filters=filters).pairs["ee"].rows.tolist()}

    assert left(Filters(rest={0: (x, 0.7)})) == every and (0, 1, 2, 3) in every
    assert every - left(Filters(rest={0: (x, 1.0)})) >= {(0, 1, 2, 3), (2, 3, 4, 5)}
    assert (0, 1, 4, 5) in left(Filters(rest={0: (x, 1.0)}))
    assert every - left(Filters(ee=[(3, 2, 1, 0)])) == {(0, 1, 2, 3)}
    # Edges of no other face than 0, which is 0 1 3, are 0-1 and 1-3.
    gone = every - left(Filters(faces=[(0, [0], 0)]))
    assert gone and all({(0, 1), (1, 3)} & {row[:2], row[2:]} for row in gone)
    assert not any((0, 1) in (row[:2], row[2:]) for row in left(Filters(faces=[(0, [0], 0)])))


def test_queries_are_packed_and_unpacked():
    rng = np.random.default_rng(1)
    for kind, names in MIXED_SCENES.items():
        top = TOPOLOGIES[kind]
        for generate in names.values():
            queries, distances = generate(rng, 2)
            assert np.isfinite(queries).all() and (distances >= 0).all()
            for query in queries:
                start, end, values = top.unpacked(query)
                assert start.shape == end.shape == top.rest.shape and len(values.planes) == top.scene.n_planes
                assert (values.separations == values.separations.T).all() and (values.separations >= 0).all()
                n = [np.size(t) for t in values.thickness]
                assert n == top.n_thickness and all((np.asarray(t) >= 0).all() for t in values.thickness)
