# SPDX-License-Identifier: Apache-2.0
"""A contact's point lies on both features at toc, to 1e-9 of their size."""

import exact_geometry
import numpy as np
import pytest
import random_scenes
import single_pairs
from fuzz.generators import EDGE_EDGE, VERTEX_FACE
from single_pairs import DEGENERATE, KINDS, REGULAR, contacts, small_steps

import hpccd_core as hc


def point_of(start, end=None):
    query = np.array([*start, *(start if end is None else end)], float)
    return single_pairs.contact(single_pairs.detector(EDGE_EDGE), EDGE_EDGE, query)[1]


def on_x(*places):
    return [(x, 0, 0) for x in places]


# "balanced" and "fast" report contacts whose features at toc do not share a point: they promise no time.
@KINDS
@pytest.mark.parametrize("accuracy", ["conservative", "exact"])
@pytest.mark.parametrize("generate", REGULAR + DEGENERATE, ids=lambda g: g.__name__)
def test_on_both_features(kind, generate, accuracy):
    detector = single_pairs.detector(kind, accuracy=accuracy)
    for query in contacts(kind, generate, 60, accuracy):
        toc, point, _ = single_pairs.contact(detector, kind, query)
        assert exact_geometry.excess(kind, query, toc, point) <= 1


@pytest.mark.parametrize("make", random_scenes.ALL, ids=lambda make: make.__name__)
def test_edges_of_random_scenes(make):
    meshes = make(np.random.default_rng(4))
    found = hc.Detector(meshes.scene(), outputs=("points",)).detect(meshes.vertices_t0, meshes.vertices_t1)
    points = found.points[len(found.vf) :]
    for i in np.random.default_rng(0).permutation(len(found.ee))[:60]:
        query = np.concatenate([meshes.vertices_t0[found.ee[i]], meshes.vertices_t1[found.ee[i]]])
        assert exact_geometry.excess(EDGE_EDGE, query, found.ee_toc[i], points[i]) <= 1


def test_middle_of_what_parallel_edges_share():
    for query in (on_x(0, 10, 9, 11), on_x(10, 0, 9, 11), on_x(9, 11, 10, 0)):
        np.testing.assert_array_equal(point_of(query), [9.5, 0, 0])
    np.testing.assert_array_equal(point_of(on_x(0, 1, 1, 3)), [1, 0, 0])
    np.testing.assert_array_equal(point_of(on_x(0, 10, 4, 5)), [4.5, 0, 0])
    falling = [(0, 0, 1), (10, 0, 1), (9, 0, 0), (11, 0, 0)]
    np.testing.assert_array_equal(point_of(falling, [(x, y, -z) for x, y, z in falling]), [9.5, 0, 0])


@pytest.mark.parametrize("length", [0, 5e-324, 1e-170, 1e-30, 1e-12])
def test_edges_of_very_different_length(length):
    for short in (on_x(0.5, 0.5 + length), [(0.5, 0, 0), (0.5, length, 0)], [(0.5, 0, 0), (0.5, length, length)]):
        for query in ((*on_x(0, 1), *short), (*short, *on_x(0, 1))):
            np.testing.assert_allclose(point_of(query), [0.5, 0, 0], rtol=0, atol=length)
            above, below = np.array(query, float), np.array(query, float)
            above[:2, 2], below[:2, 2] = 1, -1
            np.testing.assert_allclose(point_of(above, below), [0.5, 0, 0], rtol=0, atol=length)


def crossing_edges(rng, sine):
    """Edges at this angle that come together at a point between their ends, or at an end."""
    along, across = rng.normal(size=(2, 3))
    edges = []
    for direction in (along, along + sine * across):
        place = rng.choice([0, 1e-8, 0.3, 0.7, 1])
        edges += [-place * direction, (1 - place) * direction]
    start, end = np.array(edges), np.array(edges)
    rise = np.cross(along, across)
    start[:2] += rise
    end[:2] -= rise
    return np.concatenate([start, end])


def test_almost_parallel_edges():
    rng = np.random.default_rng(6)
    queries = np.array([crossing_edges(rng, sine) for sine in np.repeat(10.0 ** -np.arange(1, 17), 10)])
    queries = queries[hc.test_edge_edge(queries)[0]]  # roundings part some that meet at their ends
    assert len(queries) > 80
    detector = single_pairs.detector(EDGE_EDGE)
    for query in queries:
        toc, point, _ = single_pairs.contact(detector, EDGE_EDGE, query)
        assert exact_geometry.excess(EDGE_EDGE, query, toc, point) <= 1


def test_the_vertex_itself():
    detector = single_pairs.detector(VERTEX_FACE)
    for query in contacts(VERTEX_FACE, small_steps, 30):
        toc, point, _ = single_pairs.contact(detector, VERTEX_FACE, query)
        np.testing.assert_allclose(point, (1 - toc) * query[0] + toc * query[4], rtol=0, atol=1e-15)
