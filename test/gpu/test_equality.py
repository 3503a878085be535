# SPDX-License-Identifier: Apache-2.0
"""The GPU, alone and beside the CPU, finds the CPU's contacts, in the same order, to the last bit."""

import numpy as np
import pytest
import scenes

import hpccd_core as hc

TIERS = ("balanced", "conservative", "exact")


BACKENDS = ("gpu", "hybrid")


def assert_same(scene, t0, t1, **options):
    for backend in BACKENDS:
        found = assert_backend_same(backend, scene, t0, t1, **options)
    return found


def assert_backend_same(backend, scene, t0, t1, **options):
    cpu = hc.Detector(scene, backend="cpu", **options).detect(t0, t1)
    detector = hc.Detector(scene, backend=backend, **options)
    for _ in range(2):  # with a new tree, and with a refitted one
        gpu = detector.detect(t0, t1)
        assert detector.stats["gpu_fallbacks"] == 0, detector.last_gpu_error
        assert detector.backend == backend
        for name in ("vf", "ee", "vf_toc", "ee_toc", *cpu.outputs):
            np.testing.assert_array_equal(getattr(gpu, name), getattr(cpu, name), err_msg=name)
        assert gpu.hash == cpu.hash
        assert gpu.first_toc == cpu.first_toc
    return gpu


@pytest.mark.parametrize("accuracy", TIERS)
@pytest.mark.parametrize("dtype", (np.float32, np.float64))
@pytest.mark.parametrize("make", (scenes.crumpled, scenes.lattice, scenes.soup, scenes.fringed))
def test_random_scenes(make, dtype, accuracy):
    for seed in range(4):
        rng = np.random.default_rng(seed)
        scene, t0, t1 = scenes.join([make(rng, 30)])
        assert len(assert_same(scene, t0.astype(dtype), t1.astype(dtype), accuracy=accuracy)) > 0


@pytest.mark.parametrize("accuracy", TIERS)
def test_ropes_alone_and_beside_others(accuracy):
    rng = np.random.default_rng(15)
    for parts in ([scenes.rope(rng, 200)], [scenes.rope(rng, 90), scenes.crumpled(rng, 12), scenes.rope(rng, 2)]):
        scene, t0, t1 = scenes.join(parts)
        found = assert_same(scene, t0, t1, accuracy=accuracy, outputs=("points", "normals", "weights"))
        assert len(found.ee) > 50 and (len(found.vf) > 0) == (len(parts) > 1)


@pytest.mark.parametrize("method", ("published", "naive", "front"))
def test_published_methods_send_triangles(method):
    rng = np.random.default_rng(11)
    parts = [scenes.crumpled(rng, 24), scenes.soup(rng, 30), scenes.rope(rng, 40)]
    scene, t0, t1 = scenes.join(parts, accuracy=((0, 1, "balanced"),))
    assert_backend_same("hybrid", scene, t0, t1, method=method, restructure=True)


@pytest.mark.parametrize("segments, pairs", ((1, 1), (4, 16), (128, 2048), (16, 1 << 14)))
@pytest.mark.parametrize("threads", (1, 3))
def test_any_queue_gives_the_same_contacts(segments, pairs, threads):
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(12), 40)])
    options = {"hybrid_segments": segments, "hybrid_segment_pairs": pairs, "threads": threads}
    assert_backend_same("hybrid", scene, t0, t1, **options)


@pytest.mark.parametrize("gpus", (1, 2))
def test_any_number_of_gpus(gpus):
    if gpus > len(hc.gpu_status()["devices"]):
        pytest.skip(f"{gpus} GPUs are not here")
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(13), 60)])
    detector = hc.Detector(scene, backend="hybrid", gpus=gpus, hybrid_segment_pairs=64)
    assert detector.detect(t0, t1).hash == hc.Detector(scene, backend="cpu").detect(t0, t1).hash
    assert detector.stats["gpus"] == gpus


def test_more_gpus_than_there_are_is_rejected():
    scene, _, _ = scenes.join([scenes.crumpled(np.random.default_rng(14), 8)])
    with pytest.raises(ValueError, match="gpus: 1000 requested"):
        hc.Detector(scene, backend="hybrid", gpus=1000)


@pytest.mark.parametrize("name", ("cloth-funnel", "cloth-ball", "n-body"))
@pytest.mark.parametrize("accuracy", TIERS)
def test_truth(data_folder, name, accuracy):
    data = np.load(data_folder / f"{name}.npz")
    scene = hc.Scene()
    scene.add_mesh("scene", data["faces"], n_vertices=len(data["vertices_t0"]))
    contacts = assert_same(scene, data["vertices_t0"], data["vertices_t1"], accuracy=accuracy)
    np.testing.assert_array_equal(contacts.vf, data["vf"])
    np.testing.assert_array_equal(contacts.ee, data["ee"])
    np.testing.assert_allclose(contacts.vf_toc, data["vf_toc"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(contacts.ee_toc, data["ee_toc"], rtol=0, atol=1e-12)


def test_rules_between_meshes():
    rng = np.random.default_rng(5)
    parts = [scenes.crumpled(rng, 12) for _ in range(4)]
    scene, t0, t1 = scenes.join(
        parts, no_self=(1,), ignored=((0, 2),), accuracy=((0, 1, "balanced"), (2, 3, "conservative"))
    )
    contacts = assert_same(scene, t0, t1, accuracy="exact")
    mesh_v = np.repeat(np.arange(4), 144)
    meshes = {tuple(sorted(m)) for m in mesh_v[contacts.ee[:, [0, 2]]]}
    assert (1, 1) not in meshes and (0, 2) not in meshes and (0, 1) in meshes


def test_points_and_normals():
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(6), 16)])
    assert_same(scene, t0, t1, outputs=("points", "normals", "weights"))


@pytest.mark.parametrize("dtype", (np.float32, np.float64))
@pytest.mark.parametrize("make", (scenes.crumpled, scenes.lattice))
def test_collision_free_motions(make, dtype):
    scene, t0, t1 = scenes.join([make(np.random.default_rng(9), 16), scenes.soup(np.random.default_rng(9), 20)])
    t0, t1 = t0.astype(dtype), t1.astype(dtype)
    groups = np.arange(len(t0)) // 40 - 1
    expected = hc.Detector(scene, backend="cpu").collision_free_motion(t0, t1, groups)
    assert 0 < expected.factors.mean() < 1
    for backend in BACKENDS:
        detector = hc.Detector(scene, backend=backend)
        assert detector.collision_free_motion(t0, t1, groups) == expected
        assert len(detector.detect(t0, t1)) > 0  # its next call runs on the device again
    cupy = pytest.importorskip("cupy")
    detector = hc.Detector(scene, backend="gpu", results="device")
    assert detector.collision_free_motion(cupy.asarray(t0), cupy.asarray(t1), groups) == expected


def test_report_first_and_any():
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(7), 16)])
    assert_same(scene, t0, t1, report="first")
    every = hc.Detector(scene, backend="cpu").detect(t0, t1)
    for backend in BACKENDS:
        one = hc.Detector(scene, backend=backend, report="any").detect(t0, t1)
        assert len(one) == 1
        assert one.vf.tolist() == every.vf[:1].tolist()


def test_nothing_and_little():
    for faces, n in ((np.empty((0, 3), int), 0), (np.empty((0, 3), int), 2), ([[0, 1, 2]], 3), ([[0, 1, 2]], 5)):
        scene = hc.Scene()
        scene.add_mesh("few", faces, n_vertices=n)
        rng = np.random.default_rng(8)
        assert_same(scene, rng.normal(size=(n, 3)), rng.normal(size=(n, 3)))


def test_lists_that_overflow_grow():
    # All sheets through one place: many more pairs than the lists begin with room for.
    rng = np.random.default_rng(9)
    faces, t0, t1 = scenes.crumpled(rng, 20)
    scene, t0, t1 = scenes.join([(faces, 0.02 * t0, 0.02 * t1), (faces, 0.02 * t1, 0.02 * t0)])
    assert_same(scene, t0, t1, accuracy="balanced")


def test_bad_coordinates_are_named():
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(10), 8)])
    good = t1.copy()
    t1[3, 1] = np.nan
    for backend in BACKENDS:
        detector = hc.Detector(scene, backend=backend)
        for _ in range(2):
            with pytest.raises(ValueError, match=r"vertices_t1\[3, 1\] is NaN"):
                detector.detect(t0, t1)
            assert detector.detect(t0, good).hash == hc.Detector(scene, backend="cpu").detect(t0, good).hash
