# SPDX-License-Identifier: Apache-2.0
"""Many worlds where devices take part: as on the CPU, from arrays on the device too, and whatever fails there."""

import numpy as np
import pytest
import scenes

import hpccd_core as hc
from hpccd_core import _core

N = 5


@pytest.fixture(autouse=True)
def _disarm():
    yield
    _core.gpu_fail_after(0)


@pytest.fixture
def worlds():
    """(scene, (W,V,3) at the start, the same at the end): as many poses of a crumpled sheet."""
    rng = np.random.default_rng(8)
    scene, t0, t1 = scenes.join([scenes.crumpled(rng, 14)])
    start = t0 + rng.normal(0, 0.1, (N, *t0.shape))
    return scene, start, start + np.linspace(0, 1, N)[:, None, None] * (t1 - t0)


@pytest.mark.parametrize("backend", ("gpu", "hybrid"))
def test_whatever_fails_no_world_is_lost(worlds, backend):
    scene, start, end = worlds
    expected = hc.Detector(scene, backend="cpu", worlds=N).detect(start, end)
    for n in (1, 2, 3, 5, 8, 13, 21, 34, 55, 89, 144, 233):
        detector = hc.Detector(scene, backend=backend, threads=2, worlds=N)
        _core.gpu_fail_after(n)
        found = detector.detect(start, end)
        _core.gpu_fail_after(0)
        assert found.hash == expected.hash
        np.testing.assert_array_equal(found.vf_offsets, expected.vf_offsets)
        assert detector.detect(start, end).hash == expected.hash
        assert detector.stats["worlds"] == N


@pytest.mark.parametrize("dtype", (np.float32, np.float64))
@pytest.mark.parametrize("library", ("cupy", "torch"))
def test_from_arrays_on_the_device(worlds, library, dtype):
    module = pytest.importorskip(library)
    scene, start, end = worlds
    start, end = start.astype(dtype), end.astype(dtype)
    here = hc.Detector(scene, backend="cpu", worlds=N)
    there = hc.Detector(scene, backend="gpu", worlds=N)
    to_device = module.asarray if library == "cupy" else lambda a: module.from_numpy(a).cuda()
    on_device = [to_device(v) for v in (start, end)]
    assert there.detect(*on_device).hash == here.detect(start, end).hash
    np.testing.assert_array_equal(there.collision_free_step(*on_device), here.collision_free_step(start, end))
    assert there.proximity(on_device[0], 0.1).hash == here.proximity(start, 0.1).hash
    assert there.intersections(on_device[0]).hash == here.intersections(start).hash
    for a, b in zip(there.distances(on_device[0]), here.distances(start), strict=True):
        assert [g.distance for g in a] == [g.distance for g in b]
    for from_device, from_host in zip(on_device, (start, end), strict=True):
        assert there.step(from_device).hash == here.step(from_host).hash
    bad = end.copy()
    bad[3, 7, 1] = np.nan
    with pytest.raises(ValueError, match=r"vertices_t1\[3, 7, 1\] is NaN"):
        there.detect(on_device[0], to_device(bad))
    assert there.detect(*on_device).hash == here.detect(start, end).hash
