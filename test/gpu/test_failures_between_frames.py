# SPDX-License-Identifier: Apache-2.0
"""Failures where results stay on the device: of arrays on streams, steps, places, sorted rows, and of all memory."""

import os

import device_results
import numpy as np
import pytest
import scenes
from device_results import assert_same, garments

import hpccd_core as hc
from hpccd_core import _core

cupy = pytest.importorskip("cupy")


@pytest.fixture(autouse=True)
def _disarm():
    yield
    _core.gpu_fail_after(0)


def many_bits():
    """Some pairs are left to the CPU's integers of any size."""
    rng = np.random.default_rng(300)
    faces, t0, t1 = scenes.lattice(rng, 10)
    small = rng.integers(-3, 4, t0.shape) * 2.0**-300
    return scenes.join([(faces, t0, np.where(rng.random(t1.shape) < 0.2, small, t1))])


def sheet():
    return scenes.join([scenes.crumpled(np.random.default_rng(1), 12)])


CASES = {
    "places": (sheet, {"outputs": ("points", "closest", "weights")}),
    "sorted": (lambda: device_results.needle_through_plates(2100), {}),
    "added": (many_bits, {}),
    "any": (sheet, {"report": "any"}),
    "worlds": (lambda: garments(3, n=8), {"worlds": 3, "outputs": ("normals", "weights")}),
}


@pytest.mark.parametrize("name", CASES)
def test_every_call_may_fail_with_arrays_on_a_stream(name):
    make, options = CASES[name]
    scene, t0, t1 = make()
    expected = hc.Detector(scene, backend="cpu", **options).detect(t0, t1)
    ends = [cupy.asarray(t) for t in (t0, t1)]
    stream = cupy.cuda.Stream(non_blocking=True)
    cupy.cuda.Device().synchronize()

    def right(found):
        if name == "any":  # of any, the CPU reports the one that it finds first
            assert len(found) == len(expected) == 1
        else:
            assert_same(found, expected)

    failures = 0
    for n in range(1, 600):
        detector = hc.Detector(scene, backend="gpu", threads=2, results="device", **options)
        _core.gpu_fail_after(n)
        found = detector.detect(*ends, stream=stream)
        _core.gpu_fail_after(0)
        failed = detector.stats["gpu_fallbacks"]
        right(found)
        right(detector.detect(*ends, stream=stream))  # the device is back
        assert detector.backend == "gpu"
        right(found)  # what is held stays as it is
        if not failed:
            break
        failures += 1
    assert 30 < failures < 599


def test_a_held_result_survives_the_failures_that_follow():
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(2), 12)])
    cpu = hc.Detector(scene, backend="cpu")
    expected, back = cpu.detect(t0, t1), cpu.detect(t1, t0)
    detector = hc.Detector(scene, backend="gpu", threads=2, results="device")
    detector.detect(t1, t0)
    held = detector.detect(t0, t1)
    for n in range(1, 60):
        _core.gpu_fail_after(n)
        found = detector.detect(t1, t0)
        _core.gpu_fail_after(0)
        assert_same(found, back)
        assert_same(detector.detect(t1, t0), back)
    assert_same(held, expected)


def test_a_step_that_fails_is_processed_or_rejected_and_the_next_are_right():
    """Keeping the last positions may fail as well: then RuntimeError says so, and stepping begins again."""
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(3), 10)])
    cpu = hc.Detector(scene, backend="cpu")
    expected = cpu.detect(t0, t1)
    given = [cupy.asarray(t) for t in (t0, t1)]
    detector = hc.Detector(scene, backend="gpu", threads=2, results="device")
    processed = rejected = 0
    for n in range(1, 80):
        detector.reset()
        detector.step(given[0])
        _core.gpu_fail_after(n)
        try:
            found = detector.step(given[1])
            _core.gpu_fail_after(0)
            assert_same(found, expected)
            processed += 1
        except RuntimeError as error:
            _core.gpu_fail_after(0)
            assert "asked for by a test" in str(error)
            rejected += 1
        detector.reset()
        detector.step(given[0])
        assert_same(detector.step(given[1]), expected)
    assert processed > 20 and rejected < 10


def test_bad_coordinates_between_failures():
    scene, t0, t1 = garments(3, n=8)
    expected = hc.Detector(scene, backend="cpu", worlds=3).detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", threads=2, results="device", worlds=3)
    bad = t1.copy()
    bad[2, 5, 0] = np.inf
    for n in range(1, 60, 3):
        _core.gpu_fail_after(n)
        with pytest.raises(ValueError, match=r"vertices_t1\[2, 5, 0\] is infinite"):
            detector.detect(t0, bad)
        _core.gpu_fail_after(0)
        assert_same(detector.detect(t0, t1), expected)


@pytest.mark.parametrize("worlds", (None, 3))
def test_every_call_of_a_preparation_may_fail(worlds):
    scene, t0, t1 = garments(3, n=8) if worlds else sheet()
    expected = hc.Detector(scene, backend="cpu", worlds=worlds).detect(t0, t1)
    ends = [cupy.asarray(t) for t in (t0, t1)]
    cupy.cuda.Device().synchronize()
    detector = hc.Detector(scene, backend="gpu", threads=2, results="device", worlds=worlds)
    for n in range(1, 600):
        _core.gpu_fail_after(n)
        try:
            detection = detector.prepare(*ends)
            failed = False
        except RuntimeError as error:
            assert "asked for by a test" in str(error)
            failed = True
        _core.gpu_fail_after(0)
        assert_same(detector.detect(*ends), expected)
        assert detector.backend == "gpu"
        if not failed:
            break
    assert 30 < n < 599
    assert_same(detection.contacts(), expected)
    for n in range(1, 100):
        _core.gpu_fail_after(n)
        try:
            detection.enqueue()
            break
        except RuntimeError as error:
            assert "asked for by a test" in str(error)
        finally:
            _core.gpu_fail_after(0)
        detection.enqueue()
        assert_same(detection.contacts(), expected)
    assert 10 < n < 99


def all_memory():
    """Takes what there is, down to a few pieces of 1 MiB that the driver may keep for itself."""
    taken, size = [], cupy.cuda.runtime.memGetInfo()[0]
    while size >= 1 << 20:
        try:
            taken.append(cupy.cuda.Memory(size))
        except cupy.cuda.runtime.CUDARuntimeError:
            size //= 2
    return taken


@pytest.mark.skipif("PYTEST_XDIST_WORKER" in os.environ, reason="takes all memory: not beside other tests; without -n")
@pytest.mark.parametrize("results", ("host", "device"))
@pytest.mark.parametrize("worlds", (None, 8))
def test_without_memory_the_cpu_results_and_says_why_where_it_cannot(worlds, results):
    scene, t0, t1 = garments(8, n=30) if worlds else scenes.join([scenes.crumpled(np.random.default_rng(4), 60)])
    expected = hc.Detector(scene, backend="cpu", worlds=worlds).detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", results=results, worlds=worlds)
    cupy.get_default_memory_pool().free_all_blocks()
    taken = all_memory()
    try:
        assert_same(detector.detect(t0, t1), expected)
        assert detector.stats["gpu_fallbacks"] in (0, 1)
    except RuntimeError as error:  # not even room for the result
        assert results == "device" and "memory" in str(error)
    finally:
        taken.clear()
    for _ in range(2):
        assert_same(detector.detect(t0, t1), expected)
        assert detector.backend == "gpu"
