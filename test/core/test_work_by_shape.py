# SPDX-License-Identifier: Apache-2.0
"""The number of tests does not depend on where a scene's parts are and how they are rotated: counts of the work,
relative to an ordinary scene of the same size."""

import numpy as np
import pytest
import random_scenes

import hpccd_core as hc


def work(detector):
    stats = detector.stats
    return sum(stats.get(name, 0) for name in ("node_pairs", "leaf_pairs", "vf_candidates", "ee_candidates"))


def sheet(n, seed=0):
    """A rough sheet of size 1 with its faces."""
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    rough = 0.1 / n * np.random.default_rng(seed).normal(size=n * n)
    return random_scenes.sheet(n), np.stack([x.ravel(), y.ravel(), rough], axis=1)


def ask(query, detector, x, way=(0, 0, -0.002)):
    if query in ("detect", "separation"):
        detector.detect(x, x + way)
    elif query == "free_step":
        detector.collision_free_step(x, x + np.random.default_rng(2).normal(0, 0.004, x.shape))
    elif query == "proximity":
        detector.proximity(x, 1e-3)
    else:
        getattr(detector, query)(x)
    return work(detector)


QUERIES = ("detect", "separation", "free_step", "proximity", "intersections", "distances")


def cost(query, scene, x):
    separation = 1e-3 if query == "separation" else 0.0
    return ask(query, hc.Detector(scene, threads=1, backend="cpu", minimum_separation=separation), x)


@pytest.mark.parametrize("query", QUERIES)
@pytest.mark.parametrize("where", ["far vertex", "escaped corner", "two places"])
def test_what_lies_far_away_adds_no_work(query, where):
    n = 24
    faces, x = sheet(n)

    def at(distance):
        scene, far = hc.Scene(), distance * np.array([[0.9, 1.0, 1.1]])
        if where == "far vertex":
            scene.add_mesh("sheet", faces)
            scene.add_mesh("far", n_vertices=1)
            return cost(query, scene, np.concatenate([x, far]))
        if where == "escaped corner":
            scene.add_mesh("sheet", faces)
            return cost(query, scene, np.concatenate([x[:-1], far]))
        for name in ("here", "there"):
            scene.add_mesh(name, faces)
        return cost(query, scene, np.concatenate([x, x + far]))

    near, *distant = (at(distance) for distance in (10, 1e6, 1e9))
    assert 0 < max(distant) < 3 * near


@pytest.mark.parametrize("backend", [name for name in ("cpu", "gpu") if name in hc.backends()])
@pytest.mark.parametrize("size", [1, 0.3])
@pytest.mark.parametrize("query", QUERIES)
def test_a_mesh_that_was_torn_apart_adds_no_work_once_it_is_whole(query, size, backend):
    """A tree of that moment would keep together what is far apart later. The device knows this one call later."""
    scene, random = hc.Scene(), np.random.default_rng(0)
    faces, x = sheet(30)
    for name in ("large", "torn"):
        scene.add_mesh(name, faces, self_collision=name == "torn")
    whole = np.concatenate([x + [0, 0, 0.5], size * x])
    torn = np.concatenate([x + [0, 0, 0.5], size * random.uniform(-1, 1, x.shape)])
    separation = 1e-3 if query == "separation" else 0.0
    ago, new = (hc.Detector(scene, threads=1, backend=backend, minimum_separation=separation) for _ in range(2))
    ask(query, ago, torn)
    if backend == "gpu":
        ask(query, ago, whole)
    assert ask(query, ago, whole) < 1.5 * ask(query, new, whole)


def bars(direction, m):
    """Vertices of m * m parallel bars beside each other, 0.05 apart."""
    along = np.array(direction, float)
    along *= 9 / np.linalg.norm(along)
    w = np.cross(along, [0.3, 0.5, 0.8])
    w /= np.linalg.norm(w)
    z = np.cross(along, w) / 9
    i, j = np.divmod(np.arange(m * m), m)
    low = 0.05 * (i[:, None] * w + j[:, None] * z)
    return np.stack([low, low + along], 1).reshape(-1, 3)


def bundle(direction, m=36):
    scene = hc.Scene()
    scene.add_mesh("bars", edges=np.arange(2 * m * m).reshape(-1, 2))
    return scene, bars(direction, m)


OCTANTS = [(6, 6, 5), (-6, 6, 5), (6, -6, 5), (5, 6, -6)]


@pytest.mark.parametrize("query", ["proximity", "distances"])
@pytest.mark.parametrize("direction", [*OCTANTS, (1, 2, 0.1), (6, 5, 3)])
def test_bars_may_be_slanted(query, direction):
    assert cost(query, *bundle(direction)) < 20 * cost(query, *bundle((0, 0, 1)))


@pytest.mark.parametrize("direction", OCTANTS)
def test_bars_with_a_separation_may_be_slanted(direction):
    """Relative to all pairs of bars: none is tested for upright ones, whose boxes touch exactly or not at all."""
    scene, x = bundle(direction)
    assert cost("separation", scene, x) < 0.15 * (len(x) / 2) ** 2 / 2


@pytest.mark.parametrize("shift", [(1e7, 0.7e7, 0.9e7), (0, 0, 1e7), (3e9, 1, 1)])
def test_distances_of_meshes_far_apart_grow_with_their_size(shift):
    def of(n):
        scene = hc.Scene()
        faces, x = sheet(n)
        x[:, 2] = 0.1 * np.sin(9 * x[:, 0])
        for name in "ab":
            scene.add_mesh(name, faces, self_collision=False)
        return cost("distances", scene, np.concatenate([x, x + shift]))

    assert of(48) < 8 * of(24)
