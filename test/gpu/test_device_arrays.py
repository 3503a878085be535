# SPDX-License-Identifier: Apache-2.0
"""Positions that already live on the device."""

import importlib.util
import subprocess
import sys

import numpy as np
import pytest
import scenes

import hpccd_core as hc


@pytest.mark.parametrize("dtype", (np.float32, np.float64))
@pytest.mark.parametrize("library", ("cupy", "torch"))
def test_same_contacts_as_from_the_host(library, dtype):
    module = pytest.importorskip(library)
    scene, t0, t1 = scenes.join([scenes.lattice(np.random.default_rng(3), 20)])
    t0, t1 = t0.astype(dtype), t1.astype(dtype)
    expected = hc.Detector(scene, backend="cpu").detect(t0, t1).hash
    to_device = module.asarray if library == "cupy" else lambda a: module.from_numpy(a).cuda()
    detector = hc.Detector(scene, backend="gpu")
    for _ in range(2):
        assert detector.detect(to_device(t0), to_device(t1)).hash == expected
    assert detector.stats["gpu_fallbacks"] == 0


@pytest.mark.parametrize("library", ("cupy", "torch"))
def test_libraries_of_arrays_can_be_imported_after_the_core(library):
    if importlib.util.find_spec(library) is None:
        pytest.skip(f"{library} is not installed")
    done = subprocess.run([sys.executable, "-c", f"import hpccd_core, {library}"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("library", ("cupy", "torch"))
def test_arrays_on_another_device_than_the_detectors(library):
    module = pytest.importorskip(library)
    if len(hc.gpu_status()["devices"]) < 2:
        pytest.skip("2 GPUs are not here")
    scene, t0, t1 = scenes.join([scenes.lattice(np.random.default_rng(3), 20)])
    expected = hc.Detector(scene, backend="cpu").detect(t0, t1).hash
    detector = hc.Detector(scene, backend="gpu")
    if library == "cupy":
        with module.cuda.Device(1):
            given = [module.asarray(t) for t in (t0, t1)]
    else:
        given = [module.from_numpy(t).to("cuda:1") for t in (t0, t1)]
    for _ in range(2):
        assert detector.detect(*given).hash == expected
    detector.reset()
    assert [len(detector.step(t)) > 0 for t in given] == [False, True]
    assert detector.stats["gpu_fallbacks"] == 0


@pytest.mark.parametrize("backend", ("gpu", "hybrid"))
def test_the_callers_device_stays_current(backend):
    torch = pytest.importorskip("torch")
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(6), 12)])
    for device in range(torch.cuda.device_count()):
        torch.cuda.set_device(device)
        detector = hc.Detector(scene, backend=backend)
        detector.detect(t0, t1)
        assert detector.backend == backend
        del detector
        assert torch.cuda.current_device() == device
    torch.cuda.set_device(0)


class _OnlyDlpack:
    def __init__(self, array):
        self.array = array

    def __dlpack__(self, **options):
        return self.array.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


def test_dlpack():
    cupy = pytest.importorskip("cupy")
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(4), 12)])
    expected = hc.Detector(scene, backend="cpu").detect(t0, t1).hash
    given = [_OnlyDlpack(cupy.asarray(t)) for t in (t0, t1)]
    assert hc.Detector(scene, backend="gpu").detect(*given).hash == expected


def test_mistakes_are_named():
    cupy = pytest.importorskip("cupy")
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(5), 8)])
    d0, d1 = cupy.asarray(t0), cupy.asarray(t1)
    detector = hc.Detector(scene, backend="gpu")
    with pytest.raises(TypeError, match="one is a device array"):
        detector.detect(d0, t1)
    with pytest.raises(ValueError, match="vertices_t1: expected shape"):
        detector.detect(d0, d1[1:])
    with pytest.raises(ValueError, match="C-contiguous"):
        detector.detect(d0, cupy.asfortranarray(d1))
    with pytest.raises(TypeError, match="vertices_t0: expected float32 or float64"):
        detector.detect(d0.astype("i4"), d1)
    with pytest.raises(ValueError, match="copy it to the host"):
        hc.Detector(scene, backend="cpu").detect(d0, d1)


@pytest.mark.parametrize("library", ("cupy", "torch"))
def test_steps_stay_on_the_device(library):
    module = pytest.importorskip(library)
    rng = np.random.default_rng(6)
    scene, t0, _ = scenes.join([scenes.crumpled(rng, 20)])
    frames = [t0 + rng.normal(0, 0.3, t0.shape) for _ in range(4)]
    on_device = module.asarray(t0) if library == "cupy" else module.from_numpy(t0).cuda()
    cpu, gpu = hc.Detector(scene, backend="cpu"), hc.Detector(scene, backend="gpu")
    for frame in frames:
        # The producer writes every frame into the same array, as simulators do.
        on_device[...] = module.asarray(frame) if library == "cupy" else module.from_numpy(frame).cuda()
        assert gpu.step(on_device).hash == cpu.step(frame).hash
    assert len(gpu.detect(frames[0], frames[1])) > 0
    with pytest.raises(TypeError, match="the last step was a device array"):
        gpu.step(frames[0])
    gpu.reset()
    assert len(gpu.step(frames[0])) == 0
    with pytest.raises(TypeError, match="the last step was a host array"):
        gpu.step(on_device)


def test_a_rejected_step_does_not_count():
    cupy = pytest.importorskip("cupy")
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(7), 12)])
    bad = t0.copy()
    bad[3, 1] = np.inf
    detector = hc.Detector(scene, backend="gpu")
    for start in (True, False):
        with pytest.raises(ValueError, match=r"^vertices\[3, 1\] is infinite"):
            detector.step(cupy.asarray(bad))
        if start:
            assert len(detector.step(cupy.asarray(t0))) == 0
    with pytest.raises(TypeError, match="the last step was float64 on the device"):
        detector.step(cupy.asarray(t1.astype(np.float32)))
    assert detector.step(cupy.asarray(t1)).hash == hc.Detector(scene, backend="cpu").detect(t0, t1).hash
    with pytest.raises(ValueError, match="^vertices: is in a GPU's memory"):
        hc.Detector(scene, backend="cpu").step(cupy.asarray(t0))
