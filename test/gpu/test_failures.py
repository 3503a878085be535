# SPDX-License-Identifier: Apache-2.0
"""Whatever fails on the device, the frame is finished on the CPU and nothing is lost."""

import numpy as np
import pytest
import scenes

import hpccd_core as hc
from hpccd_core import _core


@pytest.fixture(autouse=True)
def _disarm():
    yield
    _core.gpu_fail_after(0)


def test_every_call_of_a_frame_may_fail():
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(1), 16)])
    expected = hc.Detector(scene, backend="cpu").detect(t0, t1).hash
    failures = 0
    for n in range(1, 400):
        detector = hc.Detector(scene, backend="gpu", threads=2)
        _core.gpu_fail_after(n)
        assert detector.detect(t0, t1).hash == expected
        _core.gpu_fail_after(0)
        failed = detector.stats["gpu_fallbacks"]
        if not failed:
            break
        assert failed == 1 and "asked for by a test" in detector.last_gpu_error and detector.backend == "cpu"
        failures += 1
        assert detector.detect(t0, t1).hash == expected  # the device is back
        assert detector.backend == "gpu"
    assert failures > 30


def test_after_three_failures_in_a_row_the_device_is_left_alone():
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(2), 8)])
    expected = hc.Detector(scene, backend="cpu").detect(t0, t1).hash
    detector = hc.Detector(scene, backend="gpu", threads=2)
    for i in range(5):
        _core.gpu_fail_after(1)
        assert detector.detect(t0, t1).hash == expected
        assert detector.stats["gpu_fallbacks"] == min(i + 1, 3)
    assert detector.backend == "cpu"
