# SPDX-License-Identifier: Apache-2.0
"""Many frames in a row: memory settles, auto picks a backend, the moving scene stays equal."""

import ctypes
import os
import resource

import numpy as np
import pytest
import scenes

import hpccd_core as hc


def free_device_memory():
    # The driver is loaded, as the detector uses it.
    cuda = ctypes.CDLL("libcuda.so.1")
    context = ctypes.c_void_p()
    assert cuda.cuDevicePrimaryCtxRetain(ctypes.byref(context), 0) == 0
    assert cuda.cuCtxPushCurrent_v2(context) == 0
    free, total = ctypes.c_size_t(), ctypes.c_size_t()
    assert cuda.cuMemGetInfo_v2(ctypes.byref(free), ctypes.byref(total)) == 0
    cuda.cuCtxPopCurrent_v2(ctypes.byref(context))
    cuda.cuDevicePrimaryCtxRelease_v2(0)
    return free.value


@pytest.mark.skipif("PYTEST_XDIST_WORKER" in os.environ, reason="memory of the whole device: without -n")
@pytest.mark.parametrize("backend", ("gpu", "hybrid"))
def test_a_thousand_frames_do_not_grow(backend):
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(1), 40)])
    detector = hc.Detector(scene, backend=backend, accuracy="exact", threads=2)
    hashes = set()
    for i in range(1100):
        if i == 100:
            device, host = free_device_memory(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        hashes.add(detector.detect(t0, t1).hash)
    assert len(hashes) == 1
    assert detector.stats["gpu_fallbacks"] == 0
    assert free_device_memory() == device
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - host < 2000  # KiB


def test_a_moving_scene_stays_equal():
    rng = np.random.default_rng(2)
    scene, v, _ = scenes.join([scenes.crumpled(rng, 30)])
    detectors = [hc.Detector(scene, backend=backend) for backend in ("cpu", "gpu", "hybrid", "auto")]
    detectors.append(hc.Detector(scene, backend="hybrid", method="published"))
    for _ in range(40):  # far enough that trees wear out and are rebuilt
        w = v + rng.normal(0, 0.8, v.shape)
        assert len({detector.detect(v, w).hash for detector in detectors}) == 1
        v = w
    assert all(detector.stats.get("gpu_fallbacks", 0) == 0 for detector in detectors)


def test_auto_picks_after_a_few_frames():
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(3), 60)])
    detector = hc.Detector(scene, backend="auto")
    hashes, used = set(), []
    for _ in range(15):
        hashes.add(detector.detect(t0, t1).hash)
        used.append(detector.backend)
    assert len(hashes) == 1
    assert {"cpu", "gpu", "hybrid"} == set(used[:3]) == set(used[6:9]) and len(set(used[9:])) == 1
