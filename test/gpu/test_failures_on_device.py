# SPDX-License-Identifier: Apache-2.0
"""After any failure on the device, results that stay there, and those of many worlds, are the CPU's; nothing leaks."""

import os

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


def sheet(options):
    if "worlds" in options:
        return garments(options["worlds"], n=10)
    return scenes.join([scenes.crumpled(np.random.default_rng(1), 14)])


def result_with_failure(n, detector, ask):
    """The result where the n-th call fails, or None where not even the CPU's could be brought to the device."""
    _core.gpu_fail_after(n)
    try:
        return ask(detector)
    except RuntimeError as error:
        assert "asked for by a test" in str(error)
        return None
    finally:
        _core.gpu_fail_after(0)


@pytest.mark.parametrize("query", ("detect", "proximity", "intersections"))
@pytest.mark.parametrize(
    "options",
    (
        {"results": "device"},
        {"worlds": 3},
        {"worlds": 3, "results": "device"},
        {"report": "first", "results": "device"},
    ),
    ids=lambda o: "-".join(map(str, o)),
)
def test_every_call_may_fail(options, query):
    scene, t0, t1 = sheet(options)

    def ask(detector):
        if query == "detect":
            return detector.detect(t0, t1)
        return detector.proximity(t0, 0.2) if query == "proximity" else detector.intersections(t1)

    expected = ask(hc.Detector(scene, backend="cpu", **{k: v for k, v in options.items() if k != "results"}))
    failures = 0
    for n in range(1, 500):
        detector = hc.Detector(scene, backend="gpu", threads=2, **options)
        found = result_with_failure(n, detector, ask)
        assert found is not None, f"call {n}: one failure is no reason to return nothing"
        assert_same(found, expected)
        if not detector.stats["gpu_fallbacks"]:
            break
        failures += 1
        assert_same(ask(detector), expected)  # the device is back
        assert detector.backend == "gpu"
    assert 30 < failures < 499


@pytest.mark.skipif("PYTEST_XDIST_WORKER" in os.environ, reason="memory of the whole device: without -n")
def test_failures_of_a_warm_detector_leak_nothing():
    scene, t0, t1 = garments(3, n=10)
    expected = hc.Detector(scene, backend="cpu", worlds=3).detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", worlds=3, results="device", threads=2)
    detector.detect(t0, t1)
    free = []
    for _ in range(4):
        for n in range(1, 60):
            assert_same(result_with_failure(n, detector, lambda d: d.detect(t0, t1)), expected)
            assert_same(detector.detect(t0, t1), expected)
        cupy.cuda.Device().synchronize()
        free.append(cupy.cuda.runtime.memGetInfo()[0])
    assert abs(free[-1] - free[1]) < 8 << 20


def test_two_thousand_frames_of_changing_size_settle():
    scene, t0, t1 = garments(4, n=12)
    detector = hc.Detector(scene, backend="gpu", worlds=4, results="device")
    start, way = cupy.asarray(t0), cupy.asarray(t1 - t0)
    ends = [start + i / 8 * way for i in range(9)]
    sizes = []
    for i in range(2000):
        detector.detect(start, ends[i * 5 % 9])
        sizes.append(detector.stats["gpu_bytes"])
    assert sizes[100] == sizes[-1]
