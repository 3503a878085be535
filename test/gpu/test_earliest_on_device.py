# SPDX-License-Identifier: Apache-2.0
"""How far a motion may go, asked of the GPU: bit-identical to the result of the CPU, whatever was asked before."""

import numpy as np
import pytest
import scenes

import hpccd_core as hc

TIERS = ("exact", "conservative", "balanced")


def moved(rng):
    return scenes.join([scenes.crumpled(rng, 16), scenes.lattice(rng, 6)])


def on_device(array):
    return pytest.importorskip("torch").from_numpy(np.ascontiguousarray(array)).cuda()


@pytest.mark.parametrize("separation", (0.0, 1e-3))
@pytest.mark.parametrize("accuracy", TIERS)
@pytest.mark.parametrize("seed", range(4))
def test_as_the_cpu_in_a_stream_of_trials(seed, accuracy, separation):
    rng = np.random.default_rng(seed)
    scene, t0, t1 = moved(rng)
    here = hc.Detector(scene, backend="cpu", accuracy=accuracy, minimum_separation=separation)
    there = hc.Detector(scene, backend="gpu", accuracy=accuracy, minimum_separation=separation)
    start = t0
    for trial in range(24):
        size = 10.0 ** rng.uniform(-6, 0)
        end = start + size * (t1 - t0) * rng.uniform(0.5, 1.5, size=(len(t0), 1))
        expected = here.collision_free_step(start, end)
        assert there.collision_free_step(start, end) == expected, (trial, size)
        assert expected <= min(1.0, there.detect(start, end).first_toc)
        if trial % 4 == 3:  # elsewhere
            start = start + min(expected, 0.9) * size * (t1 - t0)
    assert there.stats["gpu_fallbacks"] == 0


def test_arrays_on_the_device_and_changed_separations():
    scene, t0, t1 = moved(np.random.default_rng(9))
    here, there = (hc.Detector(scene, backend=b) for b in ("cpu", "gpu"))
    given = [on_device(t) for t in (t0, t1)]
    for separation in (0.0, 1e-4, 1e-2, 0.0, 0.0):
        for detector in (here, there):
            detector.set_separation(0, 1, separation)
        for _ in range(3):
            assert there.collision_free_step(*given) == here.collision_free_step(t0, t1)
    assert there.backend == "gpu" and there.stats["gpu_fallbacks"] == 0
    assert there.stats["near_pairs"] >= 0


def test_nothing_moves_and_nothing_touches():
    scene, t0, _ = moved(np.random.default_rng(9))
    there = hc.Detector(scene, backend="gpu")
    for scale in (1.0, 0.5, 1.0):
        assert there.collision_free_step(scale * t0, scale * t0) in (0.0, 1.0)
    with pytest.raises(ValueError, match="vertices_t1"):
        there.collision_free_step(t0, np.full_like(t0, np.nan))
    assert there.collision_free_step(t0, t0) == hc.Detector(scene, backend="cpu").collision_free_step(t0, t0)


def test_a_scene_all_of_which_counts_as_near():
    """A separation that others have, larger than a sheet that may touch itself: nearly all of its pairs are near."""
    faces, flat = scenes.sheet(90), scenes.flat(90)
    triangle = np.array([[0, 1, 2]])
    far = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    scene = hc.Scene()
    for name, of_faces, vertices in (("sheet", faces, flat), ("a", triangle, far), ("b", triangle, far)):
        scene.add_mesh(name, of_faces, n_vertices=len(vertices))
    scene.set_separation("a", "b", 40.0)
    t0 = np.concatenate([flat, far + [0, 0, 1000], far + [0, 0, 2000]])
    t1 = t0 + [0, 0, 1e-3]
    there = hc.Detector(scene, backend="gpu")
    assert [there.collision_free_step(t0, t1) for _ in range(6)] == [1.0] * 6
    assert there.stats["gpu_fallbacks"] == 0 and there.stats["near_pairs"] < 10**6
    assert there.stats["gpu_bytes"] < 2**30


@pytest.mark.parametrize("dtype", (np.float32, np.float64))
@pytest.mark.parametrize("separation", (0.0, 1e-3))
@pytest.mark.parametrize("seed", range(4))
def test_as_the_cpu_where_each_motion_begins_elsewhere(seed, separation, dtype):
    """What touched first last time bounds the next frame, wherever it begins, and whatever touches there."""
    rng = np.random.default_rng(100 + seed)
    scene, t0, t1 = moved(rng)
    options = {"accuracy": ("exact", "conservative")[seed % 2], "minimum_separation": separation}
    here, there = (hc.Detector(scene, backend=b, **options) for b in ("cpu", "gpu"))
    first = hc.Detector(scene, backend="gpu", report="first", **options)
    every = hc.Detector(scene, backend="cpu", **options)
    for trial in range(24):
        far = rng.normal(size=3) * 10.0 ** rng.uniform(-2, 4)
        start = (t0 + 0.1 * rng.normal(size=t0.shape) + far).astype(dtype)
        end = (start + 10.0 ** rng.uniform(-5, 0) * (t1 - t0)).astype(dtype)
        if trial % 6 == 5:  # nothing moves, and the meshes are far apart
            start[:, 2] += np.where(np.arange(len(t0)) < 256, 50, 0).astype(dtype)
            end = start
        assert there.collision_free_step(start, end) == here.collision_free_step(start, end), trial
        found, all_found = first.detect(start, end), every.detect(start, end)
        assert found.first_toc == all_found.first_toc, trial
        for kind in ("vf", "ee"):
            toc = getattr(all_found, f"{kind}_toc")
            np.testing.assert_array_equal(getattr(found, kind), getattr(all_found, kind)[toc == all_found.first_toc])
    assert there.stats["gpu_fallbacks"] == 0 and first.stats["gpu_fallbacks"] == 0


def test_an_early_contact_leaves_out_most_of_the_search():
    """Two flat sheets that pass through each other, one corner of which touches first: from the second frame on, the
    boxes reach up to that."""
    n = 64
    faces, flat = scenes.sheet(n), scenes.flat(n)
    tilted = flat + [0.3, 0.2, 1.0] + flat[:, :1] * [0, 0, 0.25]
    scene, t0, t1 = scenes.join([(faces, flat, flat), (faces, tilted, tilted - [0, 0, 40])], no_self=(0, 1))
    detector = hc.Detector(scene, backend="gpu")
    candidates = []
    for step in range(4):
        shift = [0, 0, 0.01 * step]
        assert 0 < detector.collision_free_step(t0 + shift, t1 + shift) < 0.05
        candidates.append(detector.stats["vf_candidates"] + detector.stats["ee_candidates"])
    assert max(candidates[1:]) < candidates[0] / 4


def test_what_is_told_of_a_call_that_lists_for_those_to_come():
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(4), 16)])
    t1 = t0 + 1e-5 * (t1 - t0)
    there = hc.Detector(scene, backend="gpu")
    told = []
    for _ in range(3):
        assert there.collision_free_step(t0, t1) == hc.Detector(scene, backend="cpu").collision_free_step(t0, t1)
        told.append(there.stats)
    assert told[0]["near_pairs"] == 0 and told[1]["near_pairs"] > 0 and told[2]["near_pairs"] == told[1]["near_pairs"]
    assert 0 < told[1]["leaf_pairs"] <= told[0]["leaf_pairs"]  # of the search, not of the listing
    assert told[2]["leaf_pairs"] == 0  # the list alone


def test_hints_of_a_frame_before_one_whose_lists_overflow():
    """A few contacts, then hundreds of thousands: lists that were long enough are not, and the frame runs again."""
    n = 120
    faces, flat = scenes.sheet(n), scenes.flat(n)
    rng = np.random.default_rng(8)
    scene, t0, t1 = scenes.join([(faces, flat, flat), (faces, flat, flat)])
    here, there = (hc.Detector(scene, backend=b) for b in ("cpu", "gpu"))
    first = hc.Detector(scene, backend="gpu", report="first")
    for height, spread in ((1.0, 0.0), (1.0, 2.0), (1.0, 0.0), (0.01, 3.0)):
        start = t0 + [0.3, 0.2, 0.0] * (np.arange(len(t0)) >= n * n)[:, None]
        start[n * n :, 2] = height + 1e-3 * np.arange(n * n)
        end = start + spread * rng.normal(size=t0.shape)
        end[n * n :, 2] -= 1.5
        expected = here.collision_free_step(start, end)
        assert there.collision_free_step(start, end) == expected < 1
        assert 0 <= first.detect(start, end).first_toc - expected <= 1e-9
    assert there.stats["gpu_fallbacks"] == first.stats["gpu_fallbacks"] == 0


@pytest.mark.parametrize("seed", range(3))
def test_one_detector_asked_everything_in_any_order(seed):
    """Hints, lists, separations and trees of one query are no other's: not after contacts at the start, either."""
    rng = np.random.default_rng(seed)
    parts = [scenes.crumpled(rng, 12), scenes.lattice(rng, 6), scenes.soup(rng, 20)]
    scene, t0, t1 = scenes.join(parts)
    far_apart = t0 + 1000.0 * np.repeat(np.arange(3), [len(t) for _, t, _ in parts])[:, None]
    here, there = ([hc.Detector(scene, backend=b, report=r) for r in ("all", "first")] for b in ("cpu", "gpu"))
    starts = [t0, t0 + 0.1 * rng.normal(size=t0.shape), far_apart, far_apart + 0.1 * rng.normal(size=t0.shape)]
    motion = t1 - t0
    for call in range(120):
        start = starts[rng.integers(len(starts))]
        end = start + 10.0 ** rng.uniform(-6, 0) * motion if call % 7 else start
        dtype = (np.float32, np.float64)[rng.integers(2)]
        given = [start.astype(dtype), end.astype(dtype)]
        asked = [on_device(x) for x in given] if rng.random() < 0.3 else given
        which, question = rng.integers(2), rng.integers(6)
        if question == 0:
            separation = float(rng.choice([0.0, 0.01, 0.3]))
            for detector in (*here, *there):
                detector.set_separation(0, 1, separation)
        elif question == 1:
            distance = float(rng.choice([1e-3, 0.5, 3.0]))
            assert there[which].proximity(asked[0], distance).hash == here[0].proximity(given[0], distance).hash
        elif question == 2:
            assert there[which].intersections(asked[0]).hash == here[0].intersections(given[0]).hash
        elif question == 3:
            assert there[which].detect(*asked).hash == here[which].detect(*given).hash, call
        else:
            assert there[which].collision_free_step(*asked) == here[which].collision_free_step(*given), call
    assert all(detector.stats["gpu_fallbacks"] == 0 for detector in there)


def test_a_pair_whose_tier_promises_times_only_with_a_separation():
    """Where the separation is switched off, nothing may be left out; on again, it may."""
    rng = np.random.default_rng(3)
    scene, t0, t1 = scenes.join(
        [scenes.crumpled(rng, 12), scenes.lattice(rng, 6)], accuracy=[("mesh0", "mesh1", "balanced")]
    )
    here, there = (hc.Detector(scene, backend=b) for b in ("cpu", "gpu"))
    for separation in (0.0, 0.05, 0.05, 0.0, 0.0, 0.05):
        for detector in (here, there):
            detector.set_separation(0, 1, separation)
        for part in (1.0, 1e-4, 1e-4, 1e-4):
            end = t0 + part * (t1 - t0)
            assert there.collision_free_step(t0, end) == here.collision_free_step(t0, end), (separation, part)
