# SPDX-License-Identifier: Apache-2.0
"""Worlds of scenes with hardly anything in them, as many as there may be, and detectors asked everything."""

import numpy as np
import pytest
import scenes
from device_results import assert_on_gpu, assert_same, garments

import hpccd_core as hc

RESULTS = ("host", "device")
NO_FACES = np.zeros((0, 3), np.uint32)
TRIANGLES = np.array([[0, 1, 2], [3, 4, 5]])


def of_mesh(faces=NO_FACES, n_vertices=None):
    scene = hc.Scene()
    scene.add_mesh("mesh", faces, n_vertices=n_vertices)
    return scene


def empty_meshes_among_others():
    scene = hc.Scene()
    scene.add_mesh("nothing", NO_FACES, n_vertices=0)
    scene.add_mesh("triangle", [[0, 1, 2]])
    scene.add_mesh("points", NO_FACES, n_vertices=3)
    scene.add_mesh("other", [[2, 1, 0]], n_vertices=4)
    return scene


LITTLE = {
    "no mesh": hc.Scene,
    "no vertices": lambda: of_mesh(n_vertices=0),
    "vertices in no face": lambda: of_mesh(n_vertices=5),
    "one triangle": lambda: of_mesh([[0, 1, 2]]),
    "two triangles": lambda: of_mesh(TRIANGLES),
    "two triangles and more vertices": lambda: of_mesh(TRIANGLES, 40),
    "a face that is a point": lambda: of_mesh([[0, 0, 0], [1, 2, 3]]),
    "a face without edges": lambda: of_mesh([[0, 0, 0], [1, 1, 1]]),
    "one leaf": lambda: of_mesh(scenes.sheet(3)),
    "empty meshes among others": empty_meshes_among_others,
}


def values(array):
    return array.to_host() if hasattr(array, "to_host") else array


@pytest.mark.parametrize("worlds", (None, 1, 3))
@pytest.mark.parametrize("name", LITTLE)
def test_little(name, worlds):
    scene = LITTLE[name]()
    rng = np.random.default_rng(6)
    shape = (scene.n_vertices, 3) if worlds is None else (worlds, scene.n_vertices, 3)
    here = hc.Detector(scene, backend="cpu", worlds=worlds)
    there = [hc.Detector(scene, backend="gpu", worlds=worlds, results=results) for results in RESULTS]
    for trial in range(6):
        # Integers: they touch now and then.
        a, b = (rng.integers(-1, 2, shape).astype(np.float32 if trial % 2 else np.float64) for _ in range(2))
        for detector in there:
            assert_same(detector.detect(a, b), here.detect(a, b))
            assert_same(detector.proximity(a, 0.5), here.proximity(a, 0.5))
            assert_same(detector.intersections(b), here.intersections(b))
            np.testing.assert_array_equal(detector.collision_free_step(a, b), here.collision_free_step(a, b))
            detector.reset()
            detector.step(a)
            assert_same(detector.step(b), here.detect(a, b))
            assert_on_gpu(detector)


@pytest.mark.parametrize("results", RESULTS)
def test_one_world_says_what_a_detector_without_worlds_says(results):
    """Offsets and first_tocs of one world; world(0) is all of it."""
    scene, t0, t1 = garments(1)
    one = hc.Detector(scene, backend="gpu", worlds=1, results=results)
    plain = hc.Detector(scene, backend="gpu", results=results)
    expected = hc.Detector(scene, backend="cpu", worlds=1).detect(t0, t1)
    for found in (one.detect(t0, t1), plain.detect(t0[0], t1[0])):
        assert_same(found, expected)
        assert_same(found.world(0), expected)
        np.testing.assert_array_equal(values(found.vf_offsets), [0, len(expected.vf)])
        np.testing.assert_array_equal(values(found.ee_offsets), [0, len(expected.ee)])
    assert one.collision_free_step(t0, t1).shape == (1,)
    assert isinstance(plain.collision_free_step(t0[0], t1[0]), float)
    for found in (one.proximity(t0, 0.2), one.intersections(t1)):
        for wrong in (1, -1):
            with pytest.raises(ValueError, match=r"world: must lie in \[0, 0\]"):
                found.world(wrong)


@pytest.mark.parametrize("results", RESULTS)
@pytest.mark.parametrize("worlds", (None, 1))
def test_first_tocs_of_one_world(worlds, results):
    """(W,), of one world too, wherever results lie."""
    scene, t0, t1 = garments(1)
    garment = t0[0], t1[0]
    t0, t1 = garment if worlds is None else (t0, t1)
    found = hc.Detector(scene, backend="gpu", worlds=worlds, results=results).detect(t0, t1)
    np.testing.assert_array_equal(values(found.first_tocs), [found.first_toc])
    many = hc.Detector(scene, backend="gpu", worlds=2, results=results).detect(*(np.stack([t, t]) for t in garment))
    for one in (found, many.world(1)):
        assert values(one.first_tocs).dtype == np.float64 and np.isfinite(one.first_toc)
        np.testing.assert_array_equal(values(one.first_tocs), [found.first_toc])


@pytest.mark.parametrize("results", RESULTS)
def test_a_world_that_is_not_there(results):
    scene, t0, t1 = garments(3, n=6)
    detector = hc.Detector(scene, backend="gpu", worlds=3, results=results)
    for found in (detector.detect(t0, t1), detector.proximity(t0, 0.1), detector.intersections(t1)):
        for wrong in (3, -1, 10**30):
            with pytest.raises(ValueError, match=r"world: must lie in \[0, 2\]"):
                found.world(wrong)
        for wrong in (1.0, "0", None, True):
            with pytest.raises(TypeError, match="world: expected an integer"):
                found.world(wrong)


def test_as_many_worlds_as_there_may_be():
    """Of two triangles each; in every third they touch."""
    worlds = 65536
    t0 = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [0.3, 0.3, 1], [1, 0.3, 1], [0.3, 1, 1]])
    starts = np.repeat(t0[None], worlds, axis=0)
    ends = starts.copy()
    ends[::3, 3:, 2] = -1 - np.arange(0, worlds, 3)[:, None] / worlds
    scene = of_mesh(TRIANGLES)
    here = hc.Detector(scene, backend="cpu", worlds=worlds)
    expected, free = here.detect(starts, ends), here.collision_free_step(starts, ends)
    assert (np.isfinite(expected.first_tocs) == (np.arange(worlds) % 3 == 0)).all()
    for results in RESULTS:
        detector = hc.Detector(scene, backend="gpu", worlds=worlds, results=results)
        for _ in range(2):
            found = detector.detect(starts, ends)
            assert_same(found, expected)
            assert_on_gpu(detector)
        for k in (0, 1, 3, worlds - 1):
            assert_same(found.world(k), expected.world(k))
        np.testing.assert_array_equal(detector.collision_free_step(starts, ends), free)


@pytest.mark.parametrize("results", RESULTS)
@pytest.mark.parametrize("worlds", (None, 4))
@pytest.mark.parametrize("seed", range(2))
def test_one_detector_asked_everything_in_any_order(seed, worlds, results):
    rng = np.random.default_rng([7, seed])
    scene, at, _ = scenes.join([scenes.crumpled(rng, 8), scenes.lattice(rng, 7), scenes.soup(rng, 12)])
    at = at if worlds is None else np.stack([at * 10.0**k for k in range(worlds)])
    options = {"worlds": worlds, "backend": "gpu", "results": results}
    asked = {report: hc.Detector(scene, report=report, **options) for report in ("all", "first")}
    separation = 0.0
    for call in range(60):
        dtype = (np.float32, np.float64)[rng.integers(2)]
        start = (at + 0.1 * rng.normal(size=at.shape) if call % 3 == 0 else at).astype(dtype)
        end = (start + 10.0 ** rng.uniform(-3, 0) * rng.normal(size=at.shape)).astype(dtype)
        report = ("all", "first")[rng.integers(2)]
        fresh = hc.Detector(scene, backend="cpu", report=report, worlds=worlds)
        fresh.set_separation(0, 1, separation)
        question = rng.integers(7)
        if question == 0:
            separation = float(rng.choice([0.0, 0.01, 0.3]))
            for detector in asked.values():
                detector.set_separation(0, 1, separation)
        elif question == 1:
            assert_same(asked[report].proximity(start, 0.3), fresh.proximity(start, 0.3))
        elif question == 2:
            assert_same(asked[report].intersections(start), fresh.intersections(start))
        elif question == 3:
            found = asked[report].collision_free_step(start, end)
            np.testing.assert_array_equal(found, fresh.collision_free_step(start, end))
        elif question == 4:
            bad = end.copy()
            bad[..., -1, 1] = np.inf
            with pytest.raises(ValueError, match="infinite"):
                asked[report].detect(start, bad)
        else:
            assert_same(asked[report].detect(start, end), fresh.detect(start, end))
    for detector in asked.values():
        assert_on_gpu(detector)
