# SPDX-License-Identifier: Apache-2.0
"""The tier fast is computed in single precision on the GPU too: the CPU's contacts and times, to the last bit."""

import numpy as np
import pytest
import scenes

import hpccd_core as hc
from hpccd_core.options import FEATURES

DTYPES = (np.float32, np.float64)
STAGES = ("rejected_coplanarity", "rejected_projection", "rejected_roots", "proven_contacts", "undecided")


class _StagesDetector(hc.Detector):
    _gpu_stages = True


def assert_equal(found, expected):
    for name in ("vf", "ee", "vf_toc", "ee_toc"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)
    assert found.hash == expected.hash


def assert_same(scene, t0, t1, **options):
    options = {"accuracy": "fast"} | options
    expected = hc.Detector(scene, backend="cpu", **options).detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", **options)
    for _ in range(2):  # with a new tree, and with a refitted one
        assert_equal(detector.detect(t0, t1), expected)
        assert detector.stats["gpu_fallbacks"] == 0, detector.last_gpu_error
    return expected, detector.stats


def in_floats(scene, t0, t1, **options):
    """Whether a second step of this motion is tested in single precision."""
    detector = _StagesDetector(scene, backend="gpu", **options)
    for _ in range(2):
        detector.detect(t0, t1)
    assert detector.stats["gpu_fallbacks"] == 0, detector.last_gpu_error
    return "gpu/likely_roots" in detector.profile


def of_one(*mesh):
    return scenes.join([mesh])


def fine(rng, n, size):
    """A sheet and, so far away that its edges are this small beside the scene, a triangle."""
    faces, t0, t1 = scenes.crumpled(rng, n)
    far = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]) + 1 / size
    return scenes.join([(faces, t0, t1), (np.array([[0, 1, 2]]), far, far)])


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("make", (scenes.crumpled, scenes.lattice, scenes.soup, scenes.fringed))
def test_random_scenes(make, dtype):
    for seed in range(8):
        scene, t0, t1 = of_one(*make(np.random.default_rng(seed), 30))
        expected, _ = assert_same(scene, t0.astype(dtype), t1.astype(dtype))
        assert len(expected) > 0


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("scale", (1e-30, 1e-3, 1e6, 1e30))
def test_any_scale(scale, dtype):
    scene, t0, t1 = of_one(*scenes.crumpled(np.random.default_rng(20), 24))
    t0, t1 = (scale * t0).astype(dtype), (scale * t1).astype(dtype)
    assert_same(scene, t0, t1)
    assert in_floats(scene, t0, t1, accuracy="fast")


@pytest.mark.parametrize("name", ("cloth-funnel", "cloth-ball", "n-body"))
@pytest.mark.parametrize("dtype", DTYPES)
def test_published_scenes(data_folder, name, dtype):
    data = np.load(data_folder / f"{name}.npz")
    scene, t0, t1 = of_one(data["faces"], data["vertices_t0"].astype(dtype), data["vertices_t1"].astype(dtype))
    if dtype == np.float64:  # coordinates that are no floats
        t0 = t0 + 1e-7 * np.sin(np.arange(t0.size)).reshape(t0.shape)
    assert_same(scene, t0, t1)
    assert in_floats(scene, t0, t1, accuracy="fast")


@pytest.mark.parametrize("library", ("cupy", "torch"))
@pytest.mark.parametrize("dtype", DTYPES)
def test_positions_on_the_device(library, dtype):
    module = pytest.importorskip(library)
    to_device = module.asarray if library == "cupy" else lambda a: module.from_numpy(a).cuda()
    for scene, t0, t1 in (
        of_one(*scenes.crumpled(np.random.default_rng(21), 24)),
        of_one(*scenes.lattice(np.random.default_rng(22), 24)),
        fine(np.random.default_rng(23), 12, 1e-6),
    ):
        t0, t1 = t0.astype(dtype), t1.astype(dtype)
        expected = hc.Detector(scene, backend="cpu", accuracy="fast").detect(t0, t1)
        detector = hc.Detector(scene, backend="gpu", accuracy="fast")
        for _ in range(2):
            assert_equal(detector.detect(to_device(t0), to_device(t1)), expected)
        assert detector.stats["gpu_fallbacks"] == 0, detector.last_gpu_error


@pytest.mark.parametrize("features", (("vertex_face",), ("edge_edge",), FEATURES), ids=" ".join)
def test_tested_features(features):
    for make in (scenes.crumpled, scenes.lattice):
        scene, t0, t1 = of_one(*make(np.random.default_rng(24), 20))
        _, stats = assert_same(scene, t0, t1, features=features)
        for kind, name in (("vf", "vertex_face"), ("ee", "edge_edge")):
            assert (stats[f"{kind}_candidates"] > 0) == (name in features)


def test_features_by_pair_of_meshes():
    rng = np.random.default_rng(25)
    scene, t0, t1 = scenes.join([scenes.crumpled(rng, 12), scenes.lattice(rng, 12), scenes.soup(rng, 20)])
    scene.set_features(0, 1, ("vertex_face",))
    scene.set_features(1, 1, ("edge_edge",))
    assert_same(scene, t0, t1)


def test_rules_between_meshes():
    """What other pairs of meshes would be tested with does not matter where they are not tested."""
    rng = np.random.default_rng(26)
    parts = [scenes.crumpled(rng, 12) for _ in range(4)]
    scene, t0, t1 = scenes.join(parts, no_self=(1,), ignored=((0, 2),), accuracy=((0, 2, "exact"),))
    assert_same(scene, t0, t1)
    assert in_floats(scene, t0, t1, accuracy="fast")


def test_fast_for_every_pair_by_name():
    rng = np.random.default_rng(27)
    pairs = ((0, 0, "fast"), (0, 1, "fast"), (1, 1, "fast"))
    scene, t0, t1 = scenes.join([scenes.crumpled(rng, 12), scenes.soup(rng, 20)], accuracy=pairs)
    assert_same(scene, t0, t1, accuracy="exact")
    assert in_floats(scene, t0, t1, accuracy="exact")


def test_mixed_tiers_are_computed_as_balanced():
    rng = np.random.default_rng(28)
    parts = [scenes.crumpled(rng, 12), scenes.crumpled(rng, 12)]
    scene, t0, t1 = scenes.join(parts, accuracy=((0, 1, "exact"),))
    expected = hc.Detector(scene, backend="cpu", accuracy="balanced").detect(t0, t1)
    assert_equal(hc.Detector(scene, backend="gpu", accuracy="fast").detect(t0, t1), expected)
    assert not in_floats(scene, t0, t1, accuracy="fast")


@pytest.mark.parametrize("make", (scenes.crumpled, scenes.lattice))
def test_hybrid_and_separations_are_computed_as_balanced(make):
    scene, t0, t1 = of_one(*make(np.random.default_rng(37), 20))
    for backend, separation in (("hybrid", 0.0), ("gpu", 0.05)):
        fast, balanced = (
            hc.Detector(scene, backend=backend, accuracy=accuracy, minimum_separation=separation)
            for accuracy in ("fast", "balanced")
        )
        assert_equal(fast.detect(t0, t1), balanced.detect(t0, t1))


@pytest.mark.parametrize("size", [2.0**-k for k in range(6, 15)])
def test_too_fine_for_floats(size):
    """About where floats stop to suffice, both decide alike; beyond, fast is balanced."""
    for seed in range(3):
        scene, t0, t1 = fine(np.random.default_rng([29, seed]), 9, size)
        expected, _ = assert_same(scene, t0, t1)
    if size >= 2.0**-9:
        assert in_floats(scene, t0, t1, accuracy="fast")
    if size <= 2.0**-14:
        assert not in_floats(scene, t0, t1, accuracy="fast")
        assert_equal(hc.Detector(scene, backend="gpu", accuracy="balanced").detect(t0, t1), expected)


def test_one_detector_for_what_floats_suffice_for_and_what_not():
    rng = np.random.default_rng(30)
    scene, t0, t1 = fine(rng, 12, 1e-2)
    far0, far1 = t0.copy(), t1.copy()
    far0[-3:] *= 1e5
    far1[-3:] *= 1e5
    here, there = (hc.Detector(scene, backend=backend, accuracy="fast") for backend in ("cpu", "gpu"))
    passes = []
    for a, b in ((t0, t1), (far0, far1), (far0, far1), (t0, t1), (t0, t1)):
        assert_equal(there.detect(a, b), here.detect(a, b))
        passes.append(there.stats["gpu_passes"])
    assert there.stats["gpu_fallbacks"] == 0, there.last_gpu_error
    assert passes[1] >= passes[3] == 2  # the first time lists may have to grow, too
    assert passes[2] == passes[4] == 1


@pytest.mark.parametrize("report", ("first", "any"))
def test_reports(report):
    for make in (scenes.crumpled, scenes.lattice):
        scene, t0, t1 = of_one(*make(np.random.default_rng(31), 16))
        expected = hc.Detector(scene, backend="cpu", accuracy="fast", report=report).detect(t0, t1)
        detector = hc.Detector(scene, backend="gpu", accuracy="fast", report=report)
        for _ in range(2):
            found = detector.detect(t0, t1)
            if report == "first":  # of any, the CPU reports the one that it finds first
                assert_equal(found, expected)
            assert len(found) == len(expected)
        assert detector.stats["gpu_fallbacks"] == 0, detector.last_gpu_error


def test_how_far_a_step_may_go():
    rng = np.random.default_rng(32)
    scene, t0, t1 = of_one(*scenes.crumpled(rng, 16))
    here, there = (hc.Detector(scene, backend=backend, accuracy="fast") for backend in ("cpu", "gpu"))
    for trial in range(12):
        end = t0 + 10.0 ** rng.uniform(-4, 0) * (t1 - t0)
        assert there.collision_free_step(t0, end) == here.collision_free_step(t0, end), trial
        if trial % 4 == 3:
            assert_equal(there.detect(t0, end), here.detect(t0, end))
    assert there.stats["gpu_fallbacks"] == 0, there.last_gpu_error


def test_lists_that_overflow_grow():
    faces, t0, t1 = scenes.crumpled(np.random.default_rng(33), 20)
    scene, t0, t1 = scenes.join([(faces, 0.02 * t0, 0.02 * t1), (faces, 0.02 * t1, 0.02 * t0)])
    detector = hc.Detector(scene, backend="gpu", accuracy="fast")
    expected = hc.Detector(scene, backend="cpu", accuracy="fast").detect(t0, t1)
    passes = []
    for _ in range(2):
        assert_equal(detector.detect(t0, t1), expected)
        passes.append(detector.stats["gpu_passes"])
    assert passes[0] > 1 == passes[1]


def test_every_pair_is_counted_once():
    for make in (scenes.crumpled, scenes.lattice, scenes.soup, scenes.fringed):
        scene, t0, t1 = of_one(*make(np.random.default_rng(34), 24))
        _, stats = assert_same(scene, t0, t1)
        for kind in ("vf", "ee"):
            counts = [stats[f"{kind}_{stage}"] for stage in STAGES]
            assert sum(counts) == stats[f"{kind}_candidates"]
            assert max(counts) <= stats[f"{kind}_candidates"]


def test_nothing_and_little():
    for faces, n in ((np.empty((0, 3), int), 0), (np.empty((0, 3), int), 2), ([[0, 1, 2]], 3), ([[0, 1, 2]], 5)):
        scene = hc.Scene()
        scene.add_mesh("few", faces, n_vertices=n)
        rng = np.random.default_rng(35)
        assert_same(scene, rng.normal(size=(n, 3)), rng.normal(size=(n, 3)))


def test_bad_coordinates_are_named():
    scene, t0, t1 = of_one(*scenes.crumpled(np.random.default_rng(36), 8))
    detector = hc.Detector(scene, backend="gpu", accuracy="fast")
    bad = t1.copy()
    bad[3, 1] = np.nan
    expected = hc.Detector(scene, backend="cpu", accuracy="fast").detect(t0, t1)
    for _ in range(2):
        with pytest.raises(ValueError, match=r"vertices_t1\[3, 1\] is NaN"):
            detector.detect(t0, bad)
        assert_equal(detector.detect(t0, t1), expected)
