# SPDX-License-Identifier: Apache-2.0
"""Many worlds in one frame: each bit for bit as alone."""

import numpy as np
import pytest
import scenes
from device_results import assert_on_gpu, assert_same, garments, needle_through_plates

import hpccd_core as hc


@pytest.mark.parametrize("results", ("host", "device"))
@pytest.mark.parametrize("report", ("all", "first"))
@pytest.mark.parametrize("accuracy", ("exact", "conservative", "balanced", "fast"))
@pytest.mark.parametrize("worlds", (1, 2, 7))
def test_contacts(worlds, accuracy, report, results):
    scene, t0, t1 = garments(worlds, dtype=np.float64 if worlds == 2 else np.float32)
    options = {"accuracy": accuracy, "report": report}
    expected = hc.Detector(scene, backend="cpu", worlds=worlds, **options).detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", worlds=worlds, results=results, **options)
    for _ in range(2):
        found = detector.detect(t0, t1)
        assert_on_gpu(detector)
        assert_same(found, expected)
    alone = hc.Detector(scene, backend="cpu", **options)
    for k in range(worlds):
        assert_same(found.world(k), alone.detect(t0[k], t1[k]))


def test_any_gives_one_pair_of_each_world():
    scene, t0, t1 = garments(4)
    every = hc.Detector(scene, backend="cpu", worlds=4).detect(t0, t1)
    found = hc.Detector(scene, backend="gpu", worlds=4, report="any").detect(t0, t1)
    for k in range(4):
        all_pairs, one = every.world(k), found.world(k)
        assert len(one) == min(1, len(all_pairs))
        np.testing.assert_array_equal(one.vf, all_pairs.vf[:1])


def test_floats_suffice_for_some_worlds_only():
    scene, t0, t1 = garments(6)
    for k in (0, 3):  # one vertex far away: edges are short beside the whole
        t0[k, -1] = t1[k, -1] = 1e6
    options = {"accuracy": "fast", "worlds": 6}
    expected = hc.Detector(scene, backend="cpu", **options).detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", **options)
    for _ in range(3):
        assert_same(detector.detect(t0, t1), expected)
        assert_on_gpu(detector)


def test_rules_between_meshes():
    rng = np.random.default_rng(3)
    parts = [scenes.crumpled(rng, 8), scenes.lattice(rng, 8), scenes.soup(rng, 12)]
    scene, t0, t1 = scenes.join(parts, no_self=(2,), ignored=((1, 2),), accuracy=((0, 1, "conservative"),))
    scene.set_features(0, 0, ("edge_edge",))
    scene.set_separation(0, 2, 0.1)
    t0, t1 = (np.stack([t + k for k in range(3)]) for t in (t0, t1))
    expected = hc.Detector(scene, backend="cpu", worlds=3).detect(t0, t1)
    assert len(expected) > 0
    assert_same(hc.Detector(scene, backend="gpu", worlds=3, results="device").detect(t0, t1), expected)


@pytest.mark.parametrize("results", ("host", "device"))
def test_other_queries(results):
    scene, t0, t1 = garments(5)
    here = hc.Detector(scene, backend="cpu", worlds=5)
    there = hc.Detector(scene, backend="gpu", worlds=5, results=results)
    for _ in range(2):
        np.testing.assert_array_equal(there.collision_free_step(t0, t1), here.collision_free_step(t0, t1))
        assert_same(there.proximity(t0, 0.3), here.proximity(t0, 0.3))
        assert_same(there.intersections(t1), here.intersections(t1))
        assert_same(there.detect(t0, t1), here.detect(t0, t1))
        assert_on_gpu(there)


@pytest.mark.parametrize("results", ("host", "device"))
def test_places(results):
    scene, t0, t1 = garments(3)
    options = {"worlds": 3, "outputs": ("points", "normals", "closest", "weights")}
    expected = hc.Detector(scene, backend="cpu", **options).detect(t0, t1)
    found = hc.Detector(scene, backend="gpu", results=results, **options).detect(t0, t1)
    assert_same(found, expected)
    assert_same(found.world(1), expected.world(1))


def test_pairs_of_one_feature_and_pairs_that_the_cpu_decides():
    scene, t0, t1 = needle_through_plates(3000)
    t0, t1 = np.stack([t0, t0, t1]), np.stack([t1, t0, t0])
    rng = np.random.default_rng(300)
    t1[1] += np.where(rng.random(t1[1].shape) < 0.2, rng.integers(-3, 4, t1[1].shape) * 2.0**-300, 0)
    expected = hc.Detector(scene, backend="cpu", worlds=3).detect(t0, t1)
    for results in ("host", "device"):
        assert_same(hc.Detector(scene, backend="gpu", worlds=3, results=results).detect(t0, t1), expected)


def test_bad_coordinates_name_their_world():
    scene, t0, t1 = garments(4)
    detector = hc.Detector(scene, backend="gpu", worlds=4)
    t1[2, 17, 1] = np.nan
    with pytest.raises(ValueError, match=r"vertices_t1\[2, 17, 1\] is NaN"):
        detector.detect(t0, t1)
    t1[2, 17, 1] = 0
    assert_same(detector.detect(t0, t1), hc.Detector(scene, backend="cpu", worlds=4).detect(t0, t1))
