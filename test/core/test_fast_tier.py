# SPDX-License-Identifier: Apache-2.0
"""Tier fast: where floats are too coarse for a scene it is computed as balanced, whatever else lies in the scene."""

import numpy as np
import pytest

import hpccd_core as hc

FLOOR = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]])


def wrinkled(rng, n):
    """Two cloths of n x n vertices, one above the other, that pass through each other: faces of one, both at both
    ends."""
    number = np.arange(n * n).reshape(n, n)
    corners = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.concatenate([np.stack([corners[i] for i in of], -1).reshape(-1, 3) for of in ((0, 1, 2), (0, 2, 3))])
    x, y = np.meshgrid(*[np.linspace(-1, 1, n)] * 2, indexing="ij")
    flat = np.stack([x, y, 0 * x], -1).reshape(-1, 3)
    wrinkles = lambda: rng.normal(0, 0.1 / n, flat.shape)  # noqa: E731
    upper, lower = flat + [0, 0, 0.1] + wrinkles(), 0.9 * flat + wrinkles()
    return faces, (upper, lower), (upper - [0, 0, 0.2] + wrinkles(), lower)


def in_a_room(faces, cloths, floor_first):
    """The scene, and positions of it for cloths at one end."""
    scene = hc.Scene()
    meshes = [("floor", [[0, 1, 2], [0, 2, 3]], True), *((name, faces, False) for name in "ab")]
    for name, of_mesh, static in meshes if floor_first else [*meshes[1:], meshes[0]]:
        scene.add_mesh(name, of_mesh, static=static)
    return scene, lambda both: np.concatenate([FLOOR, *both] if floor_first else [*both, FLOOR])


def by_tiers(scene, t0, t1, *tiers):
    return [hc.Detector(scene, accuracy=tier, backend="cpu").detect(t0, t1) for tier in tiers]


@pytest.mark.parametrize("floor_first", [True, False])
@pytest.mark.parametrize("edge", [3e-5, 3e-4])
def test_a_fine_cloth_in_a_large_room(floor_first, edge):
    n = 40
    faces, start, end = wrinkled(np.random.default_rng(3), n)
    scene, whole = in_a_room(faces, start, floor_first)
    size = edge * n / 2
    t0, t1 = (whole([cloth * size + [0.31, 0.22, 0.4] for cloth in both]) for both in (start, end))
    fast, balanced = by_tiers(scene, t0, t1, "fast", "balanced")
    assert len(balanced) > 1000 and fast.hash == balanced.hash


def test_meshes_that_shrink_in_the_step():
    """What counts is how long edges are at the end where they are short."""
    faces, start, end = wrinkled(np.random.default_rng(4), 30)
    scene, whole = in_a_room(faces, start, True)
    t0 = whole([cloth * 0.9 for cloth in start])
    t1 = whole([cloth * 1e-3 for cloth in end])
    fast, balanced = by_tiers(scene, t0, t1, "fast", "balanced")
    assert len(balanced) > 100 and fast.hash == balanced.hash


def test_few_wrong_results_on_ordinary_motion():
    faces, start, end = wrinkled(np.random.default_rng(5), 60)
    scene, whole = in_a_room(faces, start, True)
    fast, exact = by_tiers(scene, whole(start), whole(end), "fast", "exact")
    pairs = [{*map(tuple, found.vf), *map(tuple, found.ee)} for found in (fast, exact)]
    assert fast.hash != exact.hash  # single precision was at work: no time is the same to the last bit
    assert len(pairs[1]) > 5000 and len(pairs[0] ^ pairs[1]) <= 1e-3 * len(pairs[1])
