# SPDX-License-Identifier: Apache-2.0
"""After any failure on the device the frame is finished on the CPU and nothing is lost."""

import numpy as np
import pytest
import scenes

import hpccd_core as hc
from hpccd_core import _core


@pytest.fixture(autouse=True)
def _disarm():
    yield
    _core.gpu_fail_after(0)


@pytest.mark.parametrize("backend", ("gpu", "hybrid"))
def test_every_call_of_a_frame_may_fail(backend):
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(1), 16)])
    expected = hc.Detector(scene, backend="cpu").detect(t0, t1).hash
    # Creating the hybrid's 16 slots takes hundreds of calls alike: not all of them need to fail.
    steps = range(1, 400) if backend == "gpu" else [*range(1, 60), *range(60, 3000, 23)]
    failures = 0
    for n in steps:
        detector = hc.Detector(scene, backend=backend, threads=2)
        _core.gpu_fail_after(n)
        assert detector.detect(t0, t1).hash == expected
        _core.gpu_fail_after(0)
        failed = detector.stats["gpu_fallbacks"]
        if not failed:
            break
        assert failed == 1 and "asked for by a test" in detector.last_gpu_error and detector.backend == "cpu"
        failures += 1
        assert detector.detect(t0, t1).hash == expected  # the device is back
        assert detector.backend == backend
    assert not failed
    assert failures > 30


@pytest.mark.parametrize(
    "ask",
    (lambda d, v: d.proximity(v, 0.1), lambda d, v: d.intersections(v), lambda d, v: d.detect(v, v[::-1].copy())),
    ids=("proximity", "intersections", "separation"),
)
def test_every_call_of_a_distance_query_may_fail(ask):
    scene, vertices, _ = scenes.join([scenes.crumpled(np.random.default_rng(3), 12)])
    expected = ask(hc.Detector(scene, backend="cpu", minimum_separation=0.05), vertices).hash
    failures = 0
    for n in range(1, 400):
        detector = hc.Detector(scene, backend="gpu", threads=2, minimum_separation=0.05)
        _core.gpu_fail_after(n)
        assert ask(detector, vertices).hash == expected
        _core.gpu_fail_after(0)
        failed = detector.stats["gpu_fallbacks"]
        if not failed:
            break
        assert failed == 1 and "asked for by a test" in detector.last_gpu_error and detector.backend == "cpu"
        failures += 1
        assert ask(detector, vertices).hash == expected  # the device is back
        assert detector.backend == "gpu"
    assert not failed
    assert failures > 30


@pytest.mark.parametrize(
    "ask",
    (lambda d, v: d.proximity(v, 0.1), lambda d, v: d.intersections(v), lambda d, v: d.detect(v, v)),
    ids=("proximity", "intersections", "contacts"),
)
def test_a_device_that_does_not_start_leaves_device_arrays_to_the_cpu(ask):
    cupy = pytest.importorskip("cupy")
    scene, _, vertices = scenes.join([scenes.crumpled(np.random.default_rng(4), 12)])
    expected = ask(hc.Detector(scene, backend="cpu"), vertices).hash
    detector, there = hc.Detector(scene, backend="gpu"), cupy.asarray(vertices)
    _core.gpu_fail_after(1)
    assert ask(detector, there).hash == expected
    assert detector.stats["gpu_fallbacks"] == 1 and detector.backend == "cpu"
    assert ask(detector, there).hash == expected  # the device is back
    assert detector.backend == "gpu"


@pytest.mark.parametrize("seed", range(3, 9))
def test_every_call_of_a_hybrid_frame_on_warm_devices_may_fail(seed):
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(seed), 40)])
    expected = hc.Detector(scene, backend="cpu").detect(t0, t1).hash
    detector = hc.Detector(scene, backend="hybrid", threads=2, hybrid_segment_pairs=128)
    detector.detect(t0, t1)
    failures = 0
    for n in range(1, 200):
        assert detector.detect(t0, t1).hash == expected  # nothing of the failed frame is relied on
        assert detector.backend == "hybrid"
        _core.gpu_fail_after(n)
        assert detector.detect(t0, t1).hash == expected
        _core.gpu_fail_after(0)
        if detector.backend == "hybrid":
            break
        failures += 1
        assert detector.stats["gpu_fallbacks"] == failures
    assert 8 < failures < 199


@pytest.mark.parametrize("backend", ("gpu", "hybrid"))
def test_after_three_failures_in_a_row_the_device_is_left_alone(backend):
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(2), 8)])
    expected = hc.Detector(scene, backend="cpu").detect(t0, t1).hash
    detector = hc.Detector(scene, backend=backend, threads=2)
    for i in range(5):
        _core.gpu_fail_after(1)
        assert detector.detect(t0, t1).hash == expected
        assert detector.stats["gpu_fallbacks"] == min(i + 1, 3)
    assert detector.backend == "cpu"
