# SPDX-License-Identifier: Apache-2.0
"""Triangles that are flat, and edges that are parallel, but for rounding: their normal is noise, their distance is not.

What is known of the nearest place then may be off by the whole feature: nothing may be concluded from it, neither that
features are near nor that they are not.
"""

import numpy as np
import oracle
import pytest
from fuzz.generators import EDGE_EDGE, VERTEX_FACE

import hpccd_core as hc

KINDS = pytest.mark.parametrize("kind", [VERTEX_FACE, EDGE_EDGE])
DISTANCE = {VERTEX_FACE: oracle.distance_vertex_face, EDGE_EDGE: oracle.distance_edge_edge}
WITHIN = {VERTEX_FACE: oracle.within_vertex_face, EDGE_EDGE: oracle.within_edge_edge}
SEPARATION = {VERTEX_FACE: oracle.separation_vertex_face, EDGE_EDGE: oracle.separation_edge_edge}
TEST = {VERTEX_FACE: hc.test_vertex_face, EDGE_EDGE: hc.test_edge_edge}
# Parts of the true distance. Only at 1 is the result a contact, or a matter of the last bit.
PARTS = (0.3, 0.6, 0.9, 1 - 1e-9, 1 - 2**-52, 1.0)


def slivers(rng, kind, n):
    """(n,4,3): small integers along one line, and beside it, times a factor that rounds each of them."""
    start, direction, beside = rng.integers(-3, 4, size=(3, n, 1, 3))
    points = start + rng.integers(-3, 4, size=(n, 4, 1)) * direction
    points[:, : 1 if kind == VERTEX_FACE else 2] += beside
    points = points * 10.0 ** rng.uniform(-2, 2, size=(n, 1, 1))
    ulps = rng.random((n, 4, 3)) < 0.1
    return np.where(ulps, np.nextafter(points, rng.choice([-9e9, 9e9], size=points.shape)), points)


def samples(kind, n, part):
    points = slivers(np.random.default_rng(92), kind, n)
    return points, DISTANCE[kind](points) * part


def test_nearest_place_on_the_border_of_a_sliver():
    """Two of 500,000 of the fuzzer: a little beyond the distance that they have when rounded."""
    points = np.array(
        [
            [
                [-1.9694588860613114e-23, 2.3633506632735734e-23, -2.3633506632735734e-23],
                [-1.9694588860613114e-23, -2.3633506632735734e-23, 0.0],
                [-1.1816753316367867e-23, -1.575567108849049e-23, 3.9389177721226226e-24],
                [-3.9389177721226226e-24, -7.877835544245245e-24, 7.877835544245245e-24],
            ],
            [
                [-1.4934232363751593e-24, 2.2401348545627388e-24, 1.4934232363751593e-24],
                [-9.956154909167728e-25, -2.489038727291932e-25, -2.489038727291932e-25],
                [9.956154909167728e-25, 1.742327109104353e-24, -1.244519363645966e-24],
                [9.956154909167728e-25, 1.7423271091043525e-24, -1.244519363645966e-24],
            ],
        ]
    )
    scene = hc.Scene()
    scene.add_mesh("pair", [[1, 2, 3]], n_vertices=4)
    detector = hc.Detector(scene, backend="cpu", threads=1)
    for q, d in zip(points, (4.726701326547147e-23, 2.9868464727503183e-24), strict=True):
        assert not WITHIN[VERTEX_FACE](q[None], d)[0]
        assert len(detector.proximity(q, d).vf) == 0
        assert len(detector.proximity(q, np.nextafter(d, 1)).vf) == 1
        assert len(detector.proximity(q, 0.95 * d).vf) == 0


@KINDS
@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("accuracy", ["exact", pytest.param("conservative", marks=pytest.mark.long)])
def test_proximity(kind, part, accuracy):
    points, distance = samples(kind, 3000, part)
    scene = hc.Scene()
    scene.add_mesh("pair", [[1, 2, 3]] if kind == VERTEX_FACE else [[0, 1, 1], [2, 3, 3]], n_vertices=4)
    detector = hc.Detector(scene, accuracy=accuracy, backend="cpu", threads=1)
    pair = [0, 0] if kind == VERTEX_FACE else [0, 1, 2, 3]
    within, true = WITHIN[kind](points, distance), DISTANCE[kind](points)
    for q, d, is_near, length in zip(points, distance, within, true, strict=True):
        near = detector.proximity(q, float(d))
        pairs, values = (near.vf, near.vf_distance) if kind == VERTEX_FACE else (near.ee, near.ee_distance)
        found = values[(pairs == pair).all(axis=1)]
        assert len(found) == is_near or (accuracy == "conservative" and not is_near), (q.tolist(), d)
        assert not is_near or abs(found[0] - length) <= 1e-12 * np.abs(q).max()


@KINDS
@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("moving", [False, True])
def test_separation(kind, part, moving):
    """At rest, or towards the place at which they are that near."""
    points, distance = samples(kind, 600, part)
    start = points.copy()
    if moving:
        start[:, : 1 if kind == VERTEX_FACE else 2] += np.random.default_rng(93).normal(size=(len(points), 1, 3))
    queries = np.concatenate([start, points], axis=1)
    true_hit, true_toc = SEPARATION[kind](queries, distance)
    for q, d, is_hit, t in zip(queries, distance, true_hit, true_toc, strict=True):
        (hit,), (toc,) = TEST[kind](q[None], minimum_separation=float(d))
        assert hit == is_hit, (q.tolist(), d)
        assert not hit or abs(toc - t) <= 1e-12
