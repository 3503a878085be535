# SPDX-License-Identifier: Apache-2.0
"""Detection with a minimum separation: the GPU, alone and beside the CPU, finds the CPU's pairs, to the last bit."""

import numpy as np
import pytest
import scenes

import hpccd_core as hc

BACKENDS = ("gpu", "hybrid")
TIERS = ("fast", "balanced", "conservative", "exact")


def assert_equal(found, expected):
    for name in ("vf", "ee", "vf_toc", "ee_toc", *expected.outputs):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)
    assert found.hash == expected.hash
    assert found.first_toc == expected.first_toc


def assert_same(scene, t0, t1, backends=BACKENDS, **options):
    expected = hc.Detector(scene, backend="cpu", **options).detect(t0, t1)
    for backend in backends:
        detector = hc.Detector(scene, backend=backend, **options)
        for _ in range(2):  # with a new tree, and with a refitted one
            found = detector.detect(t0, t1)
            assert detector.stats["gpu_fallbacks"] == 0, detector.last_gpu_error
            assert detector.backend == backend
            assert_equal(found, expected)
    return expected


@pytest.mark.parametrize("accuracy", TIERS)
@pytest.mark.parametrize("dtype", (np.float32, np.float64))
@pytest.mark.parametrize("make", (scenes.crumpled, scenes.lattice, scenes.soup, scenes.fringed))
@pytest.mark.parametrize("separation", (1e-6, 0.05, 1.0))
def test_random_scenes(make, dtype, accuracy, separation):
    if accuracy == "fast" and separation < 1:
        pytest.skip("one separation is enough for the tier that promises nothing")
    scene, t0, t1 = scenes.join([make(np.random.default_rng(1), 12)])
    t0, t1 = t0.astype(dtype), t1.astype(dtype)
    contacts = assert_same(scene, t0, t1, accuracy=accuracy, minimum_separation=separation)
    assert len(contacts) > len(hc.Detector(scene, backend="cpu", accuracy=accuracy).detect(t0, t1)) * (separation == 1)


@pytest.mark.parametrize("scale, offset", ((1e-150, 0.0), (1e-20, 0.0), (1e60, 0.0), (1.0, 2.0**30)))
def test_scales_and_offsets(scale, offset):
    scene, t0, t1 = scenes.join([scenes.lattice(np.random.default_rng(2), 8)])
    contacts = assert_same(scene, scale * (t0 + offset), scale * (t1 + offset), minimum_separation=scale)
    assert len(contacts) > 0


def test_a_separation_larger_than_the_scene():
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(3), 7)])
    n_pairs = len(assert_same(scene, t0, t1, minimum_separation=1e3))
    assert n_pairs == len(assert_same(scene, t0, t1, minimum_separation=1e100)) > 1000


def three_meshes(seed):
    rng = np.random.default_rng(seed)
    return scenes.join(
        [scenes.crumpled(rng, 12), scenes.lattice(rng, 12), scenes.soup(rng, 20)],
        accuracy=((0, 1, "balanced"), (1, 2, "conservative")),
        ignored=((0, 2),),
    )


def test_separations_by_pair_of_meshes():
    scene, t0, t1 = three_meshes(4)
    scene.set_separation("mesh0", "mesh1", 0.3)
    scene.set_separation("mesh1", "mesh1", 0.1)
    contacts = assert_same(scene, t0, t1)
    plain = three_meshes(4)[0]
    assert len(contacts) > len(hc.Detector(plain, backend="cpu").detect(t0, t1)) > 0


@pytest.mark.parametrize(
    "backend, method",
    (("gpu", "default"), ("hybrid", "default"), ("hybrid", "published"), ("hybrid", "naive"), ("hybrid", "front")),
)
def test_separations_may_change_between_frames(backend, method):
    scene, t0, t1 = three_meshes(5)
    cpu, other = hc.Detector(scene, backend="cpu"), hc.Detector(scene, backend=backend, method=method)
    hashes = []
    changes = ((None, None, 0), (0, 1, 0.2), (1, 1, 0.4), (1, 1, 0), (2, 2, 1e-3), (0, 1, 0), (2, 2, 0))
    for a, b, separation in changes:
        if a is not None:
            for detector in (cpu, other):
                detector.set_separation(a, b, separation)
        expected = cpu.detect(t0, t1)
        for _ in range(2):
            assert_equal(other.detect(t0, t1), expected)
            assert other.backend == backend
        hashes.append(expected.hash)
    assert other.stats["gpu_fallbacks"] == 0, other.last_gpu_error
    assert hashes[0] == hashes[6] and hashes[1] == hashes[3] and len(set(hashes)) == 5


@pytest.mark.parametrize("method", ("published", "naive", "front"))
def test_published_methods(method):
    scene, t0, t1 = three_meshes(6)
    assert_same(scene, t0, t1, backends=("hybrid",), method=method, restructure=True, minimum_separation=0.1)


@pytest.mark.parametrize("segments, pairs", ((1, 1), (4, 16), (16, 1 << 14)))
def test_any_queue(segments, pairs):
    scene, t0, t1 = three_meshes(7)
    options = {"hybrid_segments": segments, "hybrid_segment_pairs": pairs, "threads": 3}
    assert_same(scene, t0, t1, backends=("hybrid",), minimum_separation=0.1, **options)


@pytest.mark.parametrize("separation", (0.2, 1e-9, 1e-14, 1e-300))
def test_points_normals_and_nearest_points(separation):
    scene, t0, t1 = three_meshes(8)
    scene.set_separation("mesh0", "mesh0", 0.0)
    outputs = ("points", "normals", "closest", "weights")
    contacts = assert_same(scene, t0, t1, minimum_separation=separation, outputs=outputs)
    assert len(contacts.closest) == len(contacts) > 0


def test_report_first_and_any():
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(9), 12)])
    options = {"minimum_separation": 0.01}
    assert len(assert_same(scene, t0, t1, report="first", **options)) > 0
    every = hc.Detector(scene, backend="cpu", **options).detect(t0, t1)
    for backend in BACKENDS:
        one = hc.Detector(scene, backend=backend, report="any", **options).detect(t0, t1)
        assert len(one) == 1
        assert one.vf.tolist() == every.vf[:1].tolist()


def test_rods_at_rest():
    """Two long parallel edges exactly at the separation, one sliding along the other; nothing in between."""
    scene = hc.Scene()
    for name in ("a", "b"):
        scene.add_mesh(name, np.array([[0, 1, 1], [1, 2, 2]]), n_vertices=3)
    rod = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    t0 = np.concatenate([rod, rod + [0.25, 0.5, 0]])
    t1 = np.concatenate([rod, rod + [0.5, 0.5, 0]])
    for separation, n in ((0.5, 3), (np.nextafter(0.5, 0), 0)):
        assert len(assert_same(scene, t0, t1, minimum_separation=separation).ee) == n


def test_device_arrays():
    cupy = pytest.importorskip("cupy")
    scene, t0, t1 = three_meshes(10)
    expected = hc.Detector(scene, backend="cpu", minimum_separation=0.1, outputs=("points", "weights")).detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", minimum_separation=0.1, outputs=("points", "weights"))
    for _ in range(2):
        assert_equal(detector.detect(cupy.asarray(t0), cupy.asarray(t1)), expected)


def test_a_moving_scene():
    rng = np.random.default_rng(11)
    scene, v, _ = scenes.join([scenes.crumpled(rng, 20)])
    detectors = [hc.Detector(scene, backend=b, minimum_separation=0.05) for b in ("cpu", *BACKENDS, "auto")]
    for _ in range(12):  # far enough that trees wear out and are rebuilt
        w = v + rng.normal(0, 0.8, v.shape)
        assert len({detector.detect(v, w).hash for detector in detectors}) == 1
        v = w
    assert all(detector.stats.get("gpu_fallbacks", 0) == 0 for detector in detectors)
