# SPDX-License-Identifier: Apache-2.0
"""Points, normals, nearest points and weights on the device: the CPU's bits, computed there but for few rows."""

import numpy as np
import pytest
import scenes
from device_results import assert_on_gpu, garments, needle_through_plates

import hpccd_core as hc

cupy = pytest.importorskip("cupy")

PLACES = ("points", "normals", "closest", "weights")


def bits(array):
    return np.ascontiguousarray(array).view(np.uint64)


def assert_same_places(found, expected):
    found = found.to_host()
    assert found.hash == expected.hash and len(found) == len(expected) > 0
    assert found.outputs.keys() == expected.outputs.keys()
    for name in expected.outputs:
        np.testing.assert_array_equal(bits(getattr(found, name)), bits(getattr(expected, name)), err_msg=name)


def crumpled(seed=0, n=40, dtype=np.float64):
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(seed), n)])
    return scene, t0.astype(dtype), t1.astype(dtype)


@pytest.mark.parametrize("dtype", (np.float32, np.float64))
@pytest.mark.parametrize("report", ("all", "first"))
@pytest.mark.parametrize("outputs", (("points",), ("normals",), ("weights",), ("points", "normals", "weights")))
def test_contacts(outputs, report, dtype):
    scene, t0, t1 = crumpled(dtype=dtype)
    options = {"outputs": outputs, "report": report}
    expected = hc.Detector(scene, backend="cpu", **options).detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", results="device", **options)
    for ends in ((t0, t1), (cupy.asarray(t0), cupy.asarray(t1))):
        assert_same_places(detector.detect(*ends), expected)
        assert_on_gpu(detector)
        assert detector.stats["gpu_places_on_cpu"] <= len(expected) / 8
    asked = (*outputs, *(("vertices", "approach") if "weights" in outputs else ()))
    assert {name: len(rows) for name, rows in expected.outputs.items()} == dict.fromkeys(asked, len(expected))


@pytest.mark.parametrize("seed", range(8))
def test_degenerate_features_and_coplanar_motion(seed):
    rng = np.random.default_rng(seed)
    make = scenes.lattice if seed % 2 else scenes.soup
    scene, t0, t1 = scenes.join([make(rng, 12)])
    options = {"outputs": PLACES}
    expected = hc.Detector(scene, backend="cpu", **options).detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", results="device", **options)
    for _ in range(2):
        assert_same_places(detector.detect(t0, t1), expected)
        assert_on_gpu(detector)


@pytest.mark.parametrize("scale", (1e-100, 1e-6, 1.0, 1e40))
def test_of_every_size(scale):
    scene, t0, t1 = crumpled(3)
    t0, t1 = scale * t0, scale * t1
    options = {"outputs": ("points", "normals", "weights")}
    expected = hc.Detector(scene, backend="cpu", **options).detect(t0, t1)
    assert_same_places(hc.Detector(scene, backend="gpu", results="device", **options).detect(t0, t1), expected)


@pytest.mark.parametrize("dtype", (np.float32, np.float64))
def test_separation(dtype):
    scene, t0, t1 = crumpled(4, 24, dtype)
    options = {"outputs": PLACES, "minimum_separation": 0.05}
    expected = hc.Detector(scene, backend="cpu", **options).detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", results="device", **options)
    assert_same_places(detector.detect(t0, t1), expected)
    assert_on_gpu(detector)


@pytest.mark.parametrize("dtype", (np.float32, np.float64))
def test_nearest_points_of_what_is_near(dtype):
    scene, t0, _ = crumpled(5, 30, dtype)
    options = {"outputs": ("closest", "normals", "weights")}
    detector = hc.Detector(scene, backend="gpu", results="device", **options)
    for distance in (0.02, 0.4):
        expected = hc.Detector(scene, backend="cpu", **options).proximity(t0, distance)
        assert_same_places(detector.proximity(cupy.asarray(t0), distance), expected)
        assert_on_gpu(detector)
        assert 0 < detector.stats["gpu_places_on_cpu"] or distance < 0.1


@pytest.mark.parametrize("worlds", (1, 3, 37))
def test_worlds(worlds):
    scene, t0, t1 = garments(worlds, n=16)
    options = {"outputs": PLACES, "worlds": worlds}
    cpu = hc.Detector(scene, backend="cpu", **options)
    detector = hc.Detector(scene, backend="gpu", results="device", **options)
    expected = cpu.detect(t0, t1)
    found = detector.detect(t0, t1)
    assert_same_places(found, expected)
    for k in {0, worlds // 2, worlds - 1}:
        if len(expected.world(k)):
            assert_same_places(found.world(k), expected.world(k))
    assert_same_places(detector.proximity(t0, 0.2), cpu.proximity(t0, 0.2))


def test_where_most_rows_need_integers_the_cpu_computes_all():
    """Where features touch their nearest points are for integers; more rows than there is room for."""
    scene, t0, t1 = crumpled(6, 90)
    options = {"outputs": ("closest",)}
    expected = hc.Detector(scene, backend="cpu", **options).detect(t0, t1)
    assert len(expected) > 16384
    detector = hc.Detector(scene, backend="gpu", results="device", **options)
    assert_same_places(detector.detect(t0, t1), expected)
    assert_on_gpu(detector)
    assert detector.stats["gpu_places_on_cpu"] == len(expected)


def test_what_is_held_stays_and_memory_settles():
    scene, t0, t1 = needle_through_plates(300)
    options = {"outputs": ("points", "normals", "weights")}
    expected = hc.Detector(scene, backend="cpu", **options).detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", results="device", **options)
    held = detector.detect(t0, t1)
    sizes = []
    for i in range(30):
        detector.detect(t1, t0 + (i % 5) / 4 * (t1 - t0))
        sizes.append(detector.stats["gpu_bytes"])
    assert sizes[10] == sizes[-1]
    assert_same_places(held, expected)
