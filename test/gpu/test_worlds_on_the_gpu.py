# SPDX-License-Identifier: Apache-2.0
"""Every world of a frame on the GPU is the result of a CPU's detector of its own, whatever stands in the others."""

import device_results
import numpy as np
import pytest
import scenes
from device_results import assert_on_gpu, assert_same, first_pair, garments

import hpccd_core as hc

TIERS = ("exact", "conservative", "balanced", "fast")
RESULTS = ("host", "device")


def on_host(found):
    return found.to_host() if hasattr(found, "to_host") else found


def each_alone(scene, t0, t1, **options):
    return [hc.Detector(scene, backend="cpu", threads=1, **options).detect(a, b) for a, b in zip(t0, t1, strict=True)]


def assert_each_alone(found, alone):
    """found: of all worlds; alone: of each. All that says how they stand together is looked at, too."""
    together = on_host(found)
    for k, expected in enumerate(alone):
        world = found.world(k)
        assert_same(world, expected)
        assert len(world) == len(expected) and world.first_toc == expected.first_toc
    for kind in ("vf", "ee"):
        counts = [len(getattr(a, kind)) for a in alone]
        offsets = getattr(together, f"{kind}_offsets")
        assert offsets.dtype == np.int64
        np.testing.assert_array_equal(offsets, np.cumsum([0, *counts]))
        np.testing.assert_array_equal(getattr(together, kind), np.concatenate([getattr(a, kind) for a in alone]))
    np.testing.assert_array_equal(together.first_tocs, [a.first_toc for a in alone])
    assert together.first_toc == min(a.first_toc for a in alone)
    assert together.hash == sum(a.hash * (2 * k + 1) for k, a in enumerate(alone)) % 2**64
    assert len(found) == sum(map(len, alone))


def poses(scene_t0_t1, worlds, seed=0):
    """(scene, starts, ends): copies turned, moved and scaled by up to a million; in the second nothing moves."""
    scene, t0, t1 = scene_t0_t1
    rng = np.random.default_rng([5, seed])
    starts, ends = [], []
    for k in range(worlds):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        scale, to = 10.0 ** rng.integers(-6, 7), rng.normal(size=3) * rng.choice([0, 1, 100])
        starts.append(scale * (t0 @ turn + to))
        ends.append(starts[-1] if k == 1 else scale * ((t0 + rng.uniform(0.1, 1) * (t1 - t0)) @ turn + to))
    return scene, np.stack(starts), np.stack(ends)


@pytest.mark.parametrize("dtype", (np.float32, np.float64))
@pytest.mark.parametrize("accuracy", TIERS)
@pytest.mark.parametrize("worlds", (1, 2, 3, 64))
def test_each_is_as_alone(worlds, accuracy, dtype):
    sheet = scenes.join([scenes.crumpled(np.random.default_rng(worlds), 9)])
    scene, t0, t1 = poses(sheet, worlds)
    t0, t1 = t0.astype(dtype), t1.astype(dtype)
    for report in ("all", "first"):
        options = {"accuracy": accuracy, "report": report}
        alone = each_alone(scene, t0, t1, **options)
        assert sum(map(len, alone)) > 0
        for results in RESULTS:
            detector = hc.Detector(scene, backend="gpu", worlds=worlds, results=results, **options)
            for _ in range(2):
                assert_each_alone(detector.detect(t0, t1), alone)
                assert_on_gpu(detector)


@pytest.mark.parametrize("dtype", (np.float32, np.float64))
@pytest.mark.parametrize("accuracy", TIERS)
@pytest.mark.parametrize("worlds", (1, 2, 9))
def test_how_far_each_may_go(worlds, accuracy, dtype):
    scene, t0, t1 = garments(worlds, n=9, dtype=dtype)
    there = hc.Detector(scene, backend="gpu", worlds=worlds, accuracy=accuracy)
    for part in (1.0, 0.1, 1e-3):
        end = (t0 + part * (t1 - t0)).astype(dtype)
        alone = [hc.Detector(scene, backend="cpu", accuracy=accuracy, threads=1) for _ in range(worlds)]
        expected = [d.collision_free_step(a, b) for d, a, b in zip(alone, t0, end, strict=True)]
        for _ in range(3):  # of one world from the near list, too
            found = there.collision_free_step(t0, end)
            assert found.shape == (worlds,) and found.dtype == np.float64
            np.testing.assert_array_equal(found, expected)
        assert_on_gpu(there)


@pytest.mark.parametrize("results", RESULTS)
def test_the_first_world_says_little_of_the_others(results):
    """The tree is made where the first world stands: in one place, or in another order than all others."""
    scene, t0, t1 = garments(4, n=7)
    rng = np.random.default_rng(9)
    for first in (np.zeros_like(t0[0]), t0[0] + 1e-6 * t1[0], 100 * rng.normal(size=t0[0].shape)):
        t0[0] = first
        t1[0] = first + 1
        alone = each_alone(scene, t0, t1)
        detector = hc.Detector(scene, backend="gpu", worlds=4, results=results)
        for _ in range(2):
            assert_each_alone(detector.detect(t0, t1), alone)
            assert_on_gpu(detector)


@pytest.mark.parametrize("results", RESULTS)
@pytest.mark.parametrize("accuracy", TIERS)
@pytest.mark.parametrize("worlds", (1, 2, 9))
def test_any_is_the_first_pair_of_each(worlds, accuracy, results):
    scene, t0, t1 = garments(worlds, n=9)
    alone = each_alone(scene, t0, t1, accuracy=accuracy)
    detector = hc.Detector(scene, backend="gpu", worlds=worlds, accuracy=accuracy, report="any", results=results)
    for _ in range(2):
        found = on_host(detector.detect(t0, t1))
        for k, every in enumerate(alone):
            vf, ee = first_pair(every)
            one = found.world(k)
            np.testing.assert_array_equal(one.vf, vf)
            np.testing.assert_array_equal(one.ee, ee)
            np.testing.assert_array_equal(one.vf_toc, every.vf_toc[: len(vf)])
            assert one.first_toc == min([*one.vf_toc, *one.ee_toc], default=np.inf)
        assert_on_gpu(detector)


@pytest.mark.parametrize("make", (scenes.lattice, scenes.soup, scenes.fringed))
@pytest.mark.parametrize("results", RESULTS)
def test_degenerate_features(make, results):
    """Many of these pairs only integers can tell, and some only those of any size."""
    rng = np.random.default_rng(11)
    scene, t0, t1 = scenes.join([make(rng, 14)])
    starts = np.stack([t0, t0[::-1], t0 + 1, 2.0**-40 * t0])
    ends = np.stack([t1, t1[::-1], np.where(rng.random(t1.shape) < 0.2, 2.0**-300, t1), 2.0**-40 * t1])
    alone = each_alone(scene, starts, ends)
    detector = hc.Detector(scene, backend="gpu", worlds=4, results=results)
    for _ in range(2):
        assert_each_alone(detector.detect(starts, ends), alone)
        assert_on_gpu(detector)


@pytest.mark.parametrize("report", ("all", "first"))
@pytest.mark.parametrize("results", RESULTS)
def test_rules_and_separations(report, results):
    rng = np.random.default_rng(3)
    still = (scenes.sheet(7), scenes.flat(7), scenes.flat(7))
    parts = [scenes.crumpled(rng, 8), scenes.lattice(rng, 8), scenes.soup(rng, 12), scenes.crumpled(rng, 6), still]
    tiers = ((0, 1, "conservative"), (0, 3, "conservative"), (3, 3, "balanced"))
    scene, t0, t1 = scenes.join(parts, no_self=(2,), ignored=((1, 2),), static=(4,), accuracy=tiers)
    scene.set_features(0, 0, ("edge_edge",))
    scene.set_features(1, 3, ("vertex_face",))
    scene, t0, t1 = poses((scene, t0, t1), 5)
    t1[:, -49:] = t0[:, -49:]
    here = [hc.Detector(scene, backend="cpu", report=report, threads=1) for _ in range(5)]
    there = hc.Detector(scene, backend="gpu", worlds=5, report=report, results=results)
    for separation in (0.0, 0.05, 0.2, 0.0):
        for detector in (*here, there):
            detector.set_separation(0, 3, separation)
        alone = [d.detect(a, b) for d, a, b in zip(here, t0, t1, strict=True)]
        assert_each_alone(there.detect(t0, t1), alone)
        assert_on_gpu(there)


def test_a_static_mesh_that_moves_in_one_world_is_named():
    rng = np.random.default_rng(4)
    scene, t0, t1 = scenes.join([scenes.crumpled(rng, 6), scenes.crumpled(rng, 6)], static=(1,))
    t1[36:] = t0[36:]
    t0, t1 = np.stack([t0] * 8), np.stack([t1] * 8)
    bad = t1.copy()
    bad[7, 40] += 1
    detector = hc.Detector(scene, backend="gpu", worlds=8)
    with pytest.raises(ValueError, match=r"\[7, 40"):
        detector.detect(t0, bad)
    assert_same(detector.detect(t0, t1), hc.Detector(scene, backend="cpu", worlds=8).detect(t0, t1))


@pytest.mark.parametrize("results", RESULTS)
def test_fast_where_floats_suffice_for_some(results):
    """Which worlds are tested in floats changes from frame to frame: from all to none and back."""
    scene, t0, t1 = garments(6, n=9)
    detector = hc.Detector(scene, backend="gpu", accuracy="fast", worlds=6, results=results)
    for worlds in 2 * [(), (0, 3), range(6), (5,), (), (1, 2, 3, 4)]:
        a, b = t0.copy(), t1.copy()
        for k in worlds:  # one vertex so far away that edges are short beside the whole
            a[k, -1] = b[k, -1] = 1e7
        assert_each_alone(detector.detect(a, b), each_alone(scene, a, b, accuracy="fast"))
        assert_on_gpu(detector)


@pytest.mark.parametrize("results", RESULTS)
@pytest.mark.parametrize("ask", ("detect", "proximity", "intersections", "collision_free_step", "step"))
def test_a_bad_coordinate_names_its_world(ask, results):
    scene, t0, t1 = garments(9, n=6)
    expected = hc.Detector(scene, backend="cpu", worlds=9).detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", worlds=9, results=results)
    bad = t1.copy()
    bad[7, 17, 2] = np.nan
    questions = {
        "detect": lambda: detector.detect(t0, bad),
        "proximity": lambda: detector.proximity(bad, 0.1),
        "intersections": lambda: detector.intersections(bad),
        "collision_free_step": lambda: detector.collision_free_step(t0, bad),
        "step": lambda: detector.step(bad),
    }
    for _ in range(2):
        with pytest.raises(ValueError, match=r"vertices\S*\[7, 17, 2\] is (NaN|nan)"):
            questions[ask]()
        assert_same(detector.detect(t0, t1), expected)
    assert_on_gpu(detector)


@pytest.mark.parametrize("results", RESULTS)
def test_one_feature_with_thousands_of_pairs_in_some_worlds(results):
    scene, t0, t1 = device_results.needle_through_plates(2500)
    starts, ends = np.stack([t0, t0, t0, t1]), np.stack([t1, t0, t0 + 0.5 * (t1 - t0), t0])
    for report in ("all", "first"):
        alone = each_alone(scene, starts, ends, report=report)
        detector = hc.Detector(scene, backend="gpu", worlds=4, report=report, results=results)
        for _ in range(2):
            assert_each_alone(detector.detect(starts, ends), alone)
            assert_on_gpu(detector)
