# SPDX-License-Identifier: Apache-2.0
"""Penetration depth of random convex hulls against the exact depth, which is that of their Minkowski difference."""

import itertools

import numpy as np
import oracle
import pytest

import hpccd_core as hc

STEP = 2.0**-20  # coordinates are multiples


def hull(rng, n):
    """Points of an ellipsoid and the faces of their convex hull, counterclockwise seen from outside."""
    directions = rng.normal(size=(n, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    stretch = np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.uniform(0.2, 2.0, 3)
    points = np.round(directions @ stretch.T / STEP)
    triples = np.array(list(itertools.combinations(range(n), 3)))
    a, b, c = points[triples].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    heights = normals @ points.T - (normals * a).sum(axis=1)[:, None]
    heights[np.arange(len(triples))[:, None], triples] = 0
    below, above = (heights <= 0).all(axis=1), (heights >= 0).all(axis=1)
    faces = np.concatenate([triples[below], triples[above][:, ::-1]])
    assert len(faces) == 2 * n - 4 and oracle.closed(faces)
    return points * STEP, faces


@pytest.mark.parametrize("count", [300, pytest.param(10_000, marks=pytest.mark.long)])
def test_depth_of_random_convex_pairs(count):
    """At most 1.001 times the true depth in 99 %, never below it, and free where the result says so."""
    rng = np.random.default_rng(44)
    ratios, pairs = [], []
    while len(pairs) < count:
        (v, f), (w, g) = (hull(rng, n) for n in rng.integers(8, 31, 2))
        pair = (v, f), (np.round((w + rng.normal(0, 0.5, 3)) / STEP) * STEP, g)
        if oracle.convex_depths([pair])[0] > 0:
            pairs.append(pair)
    depths = oracle.convex_depths(pairs)
    for ((v, f), (w, g)), depth in zip(pairs, depths, strict=True):
        scene = hc.Scene()
        scene.add_mesh("a", f, n_vertices=len(v))
        scene.add_mesh("b", g, n_vertices=len(w))
        found = hc.Detector(scene, backend="cpu", threads=1).penetration(np.concatenate([v, w]), "a", "b")
        ratios.append(found.depth / depth)
        assert found.lower_bound <= depth
        assert found.depth == pytest.approx(np.linalg.norm(found.translation), rel=1e-15)
        moved = v + found.translation
        rules = {"no_self_collision": [0, 1], "threads": 1}
        assert not len(oracle.intersections(np.concatenate([moved, w]), [f, g], **rules))
        assert not oracle.contained([(moved, f), (w, g)], threads=1).any()
    ratios = np.sort(ratios)
    assert ratios[0] >= 1 - 1e-12  # the moved vertices are rounded
    assert np.quantile(ratios, 0.99) <= 1.001, ratios[-10:]
