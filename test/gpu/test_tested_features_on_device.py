# SPDX-License-Identifier: Apache-2.0
"""Option features on GPUs: bit-identical to the CPU, whatever is left out; edges then cost nothing."""

import itertools

import numpy as np
import pytest
import scenes

import hpccd_core as hc
from hpccd_core.options import FEATURES

SELECTIONS = (("vertex_face",), ("edge_edge",), FEATURES)
WAYS = (("gpu", "default"), ("hybrid", "default"), ("hybrid", "published"), ("hybrid", "naive"), ("hybrid", "front"))


def three_meshes(rng, pairs=()):
    scene, t0, t1 = scenes.join(
        [scenes.crumpled(rng, 12), scenes.lattice(rng, 12), scenes.soup(rng, 20)],
        accuracy=((0, 1, "balanced"), (1, 2, "conservative")),
    )
    for a, b, features in pairs:
        scene.set_features(a, b, features)
    return scene, t0, t1


def some_pairs(rng):
    pairs = itertools.combinations_with_replacement(range(3), 2)
    return [(b, a, SELECTIONS[rng.integers(3)]) for a, b in pairs if rng.random() < 0.7]


def assert_equal(found, expected, names=("vf", "vf_toc", "ee", "ee_toc")):
    for name in names:
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)
    assert found.hash == expected.hash


def assert_no_fallback(detector):
    assert detector.stats["gpu_fallbacks"] == 0, detector.last_gpu_error


@pytest.mark.parametrize("backend, method", WAYS)
@pytest.mark.parametrize("features", SELECTIONS, ids=" ".join)
@pytest.mark.parametrize("separation", (0.0, 0.05))
def test_of_the_scene_and_by_pair_of_meshes(backend, method, features, separation):
    for seed in range(4):
        rng = np.random.default_rng([1, seed])
        scene, t0, t1 = three_meshes(rng, some_pairs(rng) if seed else ())
        options = {"features": features, "minimum_separation": separation}
        expected = hc.Detector(scene, backend="cpu", **options).detect(t0, t1)
        detector = hc.Detector(scene, backend=backend, method=method, **options)
        for _ in range(2):  # with a new tree, and with a refitted one
            assert_equal(detector.detect(t0, t1), expected)
            assert_no_fallback(detector)
        if seed == 0:
            for kind, name in (("vf", "vertex_face"), ("ee", "edge_edge")):
                assert (detector.stats[f"{kind}_candidates"] > 0) == (name in features)


@pytest.mark.parametrize("dtype", (np.float32, np.float64))
@pytest.mark.parametrize("accuracy", ("balanced", "conservative", "exact"))
@pytest.mark.parametrize("report", ("all", "first"))
def test_tiers_and_reports(dtype, accuracy, report):
    for features in SELECTIONS:
        rng = np.random.default_rng(2)
        scene, t0, t1 = scenes.join([scenes.crumpled(rng, 16), scenes.lattice(rng, 8)])
        t0, t1 = t0.astype(dtype), t1.astype(dtype)
        options = {"features": features, "accuracy": accuracy, "report": report}
        expected = hc.Detector(scene, backend="cpu", **options).detect(t0, t1)
        detector = hc.Detector(scene, backend="gpu", **options)
        for _ in range(3):  # the later ones begin with what touched first in the one before
            assert_equal(detector.detect(t0, t1), expected)
        assert_no_fallback(detector)


def test_any_is_of_what_is_tested():
    scene, t0, t1 = three_meshes(np.random.default_rng(3))
    for backend in ("gpu", "hybrid"):
        faces = hc.Detector(scene, backend=backend, features="vertex_face", report="any").detect(t0, t1)
        edges = hc.Detector(scene, backend=backend, features="edge_edge", report="any").detect(t0, t1)
        assert (len(faces.vf), len(faces.ee), len(edges.vf), len(edges.ee)) == (1, 0, 0, 1)


@pytest.mark.parametrize("features", SELECTIONS, ids=" ".join)
@pytest.mark.parametrize("seed", range(4))
def test_how_far_a_step_may_go(seed, features):
    """In a stream of trials, from starts that come again: by hints, by the near list, and by the tree."""
    rng = np.random.default_rng([4, seed])
    scene, t0, t1 = three_meshes(rng, some_pairs(rng) if seed else ())
    here, there = (hc.Detector(scene, backend=backend, features=features) for backend in ("cpu", "gpu"))
    start = t0
    for trial in range(24):
        size = 10.0 ** rng.uniform(-6, 0)
        end = start + size * (t1 - t0) * rng.uniform(0.5, 1.5, size=(len(t0), 1))
        expected = here.collision_free_step(start, end)
        assert there.collision_free_step(start, end) == expected, (trial, size)
        if trial % 4 == 3:
            start = start + min(expected, 0.9) * size * (t1 - t0)
            assert_equal(there.detect(start, end), here.detect(start, end))
    assert_no_fallback(there)


@pytest.mark.parametrize("features", SELECTIONS, ids=" ".join)
@pytest.mark.parametrize("backend", ("gpu", "hybrid"))
def test_snapshots_between_steps(features, backend):
    """Intersections and smallest distances look at whole surfaces: boxes of edges that steps did without are made."""
    rng = np.random.default_rng(5)
    pairs = some_pairs(rng)
    scene, t0, t1 = three_meshes(np.random.default_rng(6), pairs)
    here, there = (hc.Detector(scene, backend=b, features=features) for b in ("cpu", backend))
    full = hc.Detector(three_meshes(np.random.default_rng(6))[0], backend="cpu")
    for query in rng.permutation(16) % 4:
        if query == 0:
            names = ("vf", "vf_distance", "ee", "ee_distance")
            assert_equal(there.proximity(t1, 0.2), here.proximity(t1, 0.2), names)
        elif query == 1:
            found = there.intersections(t1)
            assert found.hash == here.intersections(t1).hash == full.intersections(t1).hash
            assert len(found.ef) > 0
        elif query == 2:
            for found, expected in zip(there.distances(t1), full.distances(t1), strict=True):
                assert (found.distance, found.kind, found.features) == (
                    expected.distance,
                    expected.kind,
                    expected.features,
                )
        else:
            assert_equal(there.detect(t0, t1), here.detect(t0, t1))
