# SPDX-License-Identifier: Apache-2.0
"""results="device": the CPU's results, in arrays that CuPy and PyTorch take in place."""

import device_results
import numpy as np
import pytest
import scenes
from device_results import assert_on_gpu, assert_same

import hpccd_core as hc

cupy = pytest.importorskip("cupy")

TIERS = ("exact", "conservative", "balanced", "fast")


def crumpled(seed=0, n=20, dtype=np.float64):
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(seed), n)])
    return scene, t0.astype(dtype), t1.astype(dtype)


def address(array):
    return array.__cuda_array_interface__["data"][0]


@pytest.mark.parametrize("dtype", (np.float32, np.float64))
@pytest.mark.parametrize("report", ("all", "first"))
@pytest.mark.parametrize("accuracy", TIERS)
def test_contacts(accuracy, report, dtype):
    scene, t0, t1 = crumpled(dtype=dtype)
    options = {"accuracy": accuracy, "report": report}
    expected = hc.Detector(scene, backend="cpu", **options).detect(t0, t1)
    assert len(expected) > 0
    there = hc.Detector(scene, backend="gpu", results="device", **options)
    on_device = [cupy.asarray(t0), cupy.asarray(t1)]
    for arrays, more in (((t0, t1), {}), (on_device, {}), (on_device, {"stream": cupy.cuda.get_current_stream()})):
        found = there.detect(*arrays, **more)
        assert_on_gpu(there)
        assert_same(found, expected)
        assert there.stats["gpu_exact_on_cpu"] == 0
    here = hc.Detector(scene, backend="gpu", **options)
    for _ in range(2):
        assert_same(here.detect(t0, t1), expected)


def test_results_are_compared_on_the_host():
    scene, t0, t1 = crumpled()
    detector = hc.Detector(scene, backend="gpu", results="device")
    found, again, near = detector.detect(t0, t1), detector.detect(t0, t1), detector.proximity(t0, 0.01)
    assert found == again and found != detector.detect(t0, t0) and found != near and near == near
    with pytest.raises(TypeError, match="unhashable"):
        hash(found)


def test_any_is_the_first_pair():
    scene, t0, t1 = crumpled()
    vf, ee = device_results.first_pair(hc.Detector(scene, backend="cpu").detect(t0, t1))
    for results in ("host", "device"):
        found = hc.Detector(scene, backend="gpu", report="any", results=results).detect(t0, t1)
        found = found.to_host() if results == "device" else found
        np.testing.assert_array_equal(found.vf, vf)
        np.testing.assert_array_equal(found.ee, ee)


@pytest.mark.parametrize("report", ("all", "first"))
def test_many_pairs_of_one_feature(report):
    """More than are ordered by looking at all of them: keys are sorted."""
    scene, t0, t1 = device_results.needle_through_plates(5000)
    expected = hc.Detector(scene, backend="cpu", report=report).detect(t0, t1)
    for results in ("host", "device"):
        detector = hc.Detector(scene, backend="gpu", report=report, results=results)
        for _ in range(2):
            assert_same(detector.detect(t0, t1), expected)
        assert_on_gpu(detector)


def test_pairs_that_the_cpu_decides_are_added():
    rng = np.random.default_rng(300)
    faces, t0, t1 = scenes.lattice(rng, 20)
    t1 = np.where(rng.random(t1.shape) < 0.2, rng.integers(-3, 4, t0.shape) * 2.0**-300, t1)
    scene, t0, t1 = scenes.join([(faces, t0, t1)])
    expected = hc.Detector(scene, backend="cpu").detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", results="device")
    for _ in range(2):
        assert_same(detector.detect(t0, t1), expected)
        assert_on_gpu(detector)
    assert detector.stats["gpu_exact_on_cpu"] > 0


def test_queries_of_a_snapshot_and_separations():
    scene, t0, t1 = crumpled()
    cpu = hc.Detector(scene, backend="cpu")
    detector = hc.Detector(scene, backend="gpu", results="device")
    for _ in range(2):
        assert_same(detector.proximity(cupy.asarray(t0), 0.3), cpu.proximity(t0, 0.3))
        assert_same(detector.intersections(cupy.asarray(t1)), cpu.intersections(t1))
    for options in ({"minimum_separation": 0.1}, {"outputs": ("points", "normals", "closest", "weights")}):
        expected = hc.Detector(scene, backend="cpu", **options).detect(t0, t1)
        assert_same(hc.Detector(scene, backend="gpu", results="device", **options).detect(t0, t1), expected)


def test_steps():
    scene, t0, t1 = crumpled()
    detector = hc.Detector(scene, backend="gpu", results="device")
    expected = hc.Detector(scene, backend="cpu").detect(t0, t1)
    for ends in ((t0, t1), (cupy.asarray(t0), cupy.asarray(t1))):
        detector.reset()
        detector.step(ends[0])
        assert_same(detector.step(ends[1]), expected)


def test_arrays_are_taken_in_place_and_held():
    torch = pytest.importorskip("torch")
    scene, t0, t1 = crumpled()
    detector = hc.Detector(scene, backend="gpu", results="device")
    first = detector.detect(t0, t1)
    kept = cupy.asarray(first.vf).copy()
    by_torch, by_cupy = torch.from_dlpack(first.vf_toc), cupy.from_dlpack(first.ee)
    assert by_torch.data_ptr() == address(first.vf_toc) and by_cupy.data.ptr == address(first.ee)
    place = address(first.vf)
    for _ in range(3):
        assert address(detector.detect(t1, t0).vf) != place
    assert (cupy.asarray(first.vf) == kept).all()
    del first
    assert address(detector.detect(t1, t0).vf) != place, "an array that was made of it is still held"
    del by_torch, by_cupy
    places = {address(detector.detect(t0, t1).vf) for _ in range(6)}
    assert place in places and len(places) <= 2
    last = detector.detect(t0, t1)
    del detector
    assert_same(last, hc.Detector(scene, backend="cpu").detect(t0, t1))


def test_results_on_the_host_are_held_too():
    """They lie where the device has written them, a few of them; more are copied."""
    scene, t0, t1 = crumpled()
    expected = hc.Detector(scene, backend="cpu").detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu")
    held = [detector.detect(t0, t1) for _ in range(9)]
    detector.detect(t1, t0)
    del detector
    for contacts in held:
        assert_same(contacts, expected)


def test_memory_settles():
    scene, t0, t1 = crumpled()
    detector = hc.Detector(scene, backend="gpu", results="device")
    sizes = []
    for i in range(60):
        detector.detect(t0, t0 + (i % 5) / 4 * (t1 - t0))
        sizes.append(detector.stats["gpu_bytes"])
    assert sizes[20] == sizes[-1]


@pytest.mark.parametrize("n_vertices", (0, 4))
def test_nothing_to_look_at(n_vertices):
    scene = hc.Scene()
    scene.add_mesh("points", np.zeros((0, 3), np.uint32), n_vertices=n_vertices)
    for worlds, shape in ((None, (n_vertices, 3)), (3, (3, n_vertices, 3))):
        v = np.zeros(shape)
        for results in ("host", "device"):
            detector = hc.Detector(scene, backend="gpu", worlds=worlds, results=results)
            assert_same(detector.detect(v, v), hc.Detector(scene, backend="cpu", worlds=worlds).detect(v, v))
