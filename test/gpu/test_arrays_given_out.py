# SPDX-License-Identifier: Apache-2.0
"""Arrays of results on the device, as other libraries see them: what they say of themselves, and whose memory it is."""

import gc
import os

import device_results
import numpy as np
import pytest
import scenes
from device_results import assert_on_gpu, assert_same

import hpccd_core as hc

cupy = pytest.importorskip("cupy")

ROWS = {"vf": ((2,), "<u4"), "ee": ((4,), "<u4"), "vf_toc": ((), "<f8"), "ee_toc": ((), "<f8")}
PLACES = {
    "points": ((3,), "<f8"),
    "normals": ((3,), "<f8"),
    "closest": ((2, 3), "<f8"),
    "vertices": ((4,), "<u4"),
    "weights": ((4,), "<f8"),
    "approach": ((), "<f8"),
}
OUTPUTS = ("points", "normals", "closest", "weights")
N = 20


def crumpled():
    return scenes.join([scenes.crumpled(np.random.default_rng(0), N)])


def address(array):
    return array.__cuda_array_interface__["data"][0]


def settled(scene, t0, t1, **options):
    """A detector whose lists have grown to what this motion needs."""
    detector = hc.Detector(scene, backend="gpu", results="device", **options)
    for _ in range(3):
        detector.detect(t0, t1)
    return detector


def test_what_they_say_of_themselves():
    scene, t0, t1 = crumpled()
    found = hc.Detector(scene, backend="gpu", results="device", outputs=OUTPUTS).detect(t0, t1)
    host = found.to_host()
    assert len(found) == len(host) > 0
    arrays = {name: (row, kind, len(getattr(host, name))) for name, (row, kind) in ROWS.items()}
    arrays |= {name: (row, kind, len(host)) for name, (row, kind) in PLACES.items()}
    for name, (row, kind, n) in arrays.items():
        array = getattr(found, name)
        interface = array.__cuda_array_interface__
        assert interface["shape"] == array.shape == (n, *row) == getattr(host, name).shape, name
        assert interface["typestr"] == kind and array.dtype == np.dtype(kind) == getattr(host, name).dtype
        assert interface["data"][0] > 0 and interface["data"][1] is False
        assert interface.get("strides") is None and interface["version"] >= 2
        assert len(array) == n
        assert array.__dlpack_device__() == (2, array.device)
        assert f"{array.shape}" in repr(array)
        for taken in (cupy.asarray(array), cupy.from_dlpack(array)):
            assert taken.data.ptr == address(array) and taken.flags.c_contiguous
            np.testing.assert_array_equal(taken.get(), getattr(host, name))
        assert array.to_host().flags.writeable


def test_torch_takes_them_in_place():
    torch = pytest.importorskip("torch")
    scene, t0, t1 = crumpled()
    found = hc.Detector(scene, backend="gpu", results="device").detect(t0, t1)
    for name in ROWS:
        array = getattr(found, name)
        if name in ("vf", "ee") and not hasattr(torch, "uint32"):
            continue  # older than 2.3
        taken = torch.from_dlpack(array)
        assert taken.is_cuda and taken.data_ptr() == address(array) and tuple(taken.shape) == array.shape
        np.testing.assert_array_equal(taken.cpu().numpy(), array.to_host())
    assert torch.as_tensor(found.vf_toc, device="cuda").data_ptr() == address(found.vf_toc)


@pytest.mark.parametrize("worlds", (None, 1, 3))
def test_of_nothing(worlds):
    """No rows: the usual shapes and dtypes, and nobody needs an address."""
    scene, _, _ = crumpled()
    flat = scenes.flat(N)
    given = flat if worlds is None else np.stack([flat] * worlds)
    detector = hc.Detector(scene, backend="gpu", results="device", worlds=worlds, outputs=OUTPUTS)
    for _ in range(2):
        found = detector.detect(given, given)
        assert_on_gpu(detector)
        assert len(found) == 0 and found.first_toc == np.inf and found.hash == 0
        for name, (row, kind) in ROWS.items():
            array = getattr(found, name)
            assert array.shape == (0, *row) and array.dtype == np.dtype(kind)
            assert cupy.asarray(array).shape == cupy.from_dlpack(array).shape == array.shape
        for name, (row, kind) in PLACES.items():
            array = getattr(found, name).to_host()
            assert array.shape == (0, *row) and array.dtype == np.dtype(kind)
        alone = hc.Detector(scene, backend="cpu").detect(flat, flat)
        for k in range(worlds or 1):
            np.testing.assert_array_equal(found.world(k).to_host().vf, alone.vf)
            assert found.world(k).hash == alone.hash
        torch = pytest.importorskip("torch")
        assert tuple(torch.from_dlpack(found.vf_toc).shape) == (0,)


def test_what_dlpack_may_ask_for():
    scene, t0, t1 = crumpled()
    found = hc.Detector(scene, backend="gpu", results="device").detect(t0, t1)
    device = found.vf.__dlpack_device__()
    for options in ({"stream": 1}, {"max_version": (1, 0)}, {"dl_device": device}, {"copy": False}, {"copy": None}):
        assert "dltensor" in repr(found.vf.__dlpack__(**options))
    with pytest.raises(BufferError, match="copy"):
        found.vf.__dlpack__(copy=True)
    with pytest.raises(BufferError, match="to_host"):
        found.vf.__dlpack__(dl_device=(1, 0))
    with pytest.raises((BufferError, RuntimeError, TypeError)):  # numpy's own words
        np.from_dlpack(found.vf)


def test_numpy_is_told_how_to_get_them():
    scene, t0, t1 = crumpled()
    found = hc.Detector(scene, backend="gpu", results="device").detect(t0, t1)
    for array in (found.vf, found.vf_toc, found.vf_offsets):
        for ask in (np.asarray, np.array, lambda a: np.asarray(a, np.float64), lambda a: np.add(a, 1), np.concatenate):
            with pytest.raises(TypeError, match="to_host"):
                ask(array if ask is not np.concatenate else [array, array])


def test_capsules_that_nobody_takes_give_memory_back():
    scene, t0, t1 = crumpled()
    detector = settled(scene, t0, t1)
    found = detector.detect(t0, t1)
    place = address(found.vf)
    capsules = [found.vf.__dlpack__() for _ in range(5)]
    del found
    assert address(detector.detect(t0, t1).vf) != place, "a capsule still holds it"
    del capsules
    gc.collect()
    assert place in {address(detector.detect(t0, t1).vf) for _ in range(3)}


@pytest.mark.parametrize("how", ("interface", "dlpack", "slice", "world", "offsets"))
def test_whatever_was_made_of_them_holds_their_memory(how):
    scene, t0, t1 = device_results.garments(3)
    detector = settled(scene, t0, t1, worlds=3)
    expected = hc.Detector(scene, backend="cpu", worlds=3).detect(t0, t1)
    found = detector.detect(t0, t1)
    held = {
        "interface": lambda c: cupy.asarray(c.ee_toc),
        "dlpack": lambda c: cupy.from_dlpack(c.ee_toc),
        "slice": lambda c: cupy.from_dlpack(c.ee_toc)[1:],
        "world": lambda c: c.world(1),
        "offsets": lambda c: c.vf_offsets,
    }[how](found)
    place = address(found.ee)
    del found
    gc.collect()
    for _ in range(4):
        assert address(detector.detect(t1, t0).ee) != place
    del detector
    gc.collect()
    if how == "world":
        assert_same(held, expected.world(1))
    elif how == "offsets":
        np.testing.assert_array_equal(held.to_host(), expected.vf_offsets)
    else:
        np.testing.assert_array_equal(held.get(), expected.ee_toc[1:] if how == "slice" else expected.ee_toc)


@pytest.mark.skipif("PYTEST_XDIST_WORKER" in os.environ, reason="memory of the whole device: without -n")
def test_memory_of_dropped_results_is_taken_again():
    scene, t0, t1 = crumpled()
    detector = settled(scene, t0, t1)
    first = address(detector.detect(t0, t1).vf)
    free, sizes = [], set()
    for _ in range(50):
        assert address(detector.detect(t0, t1).vf) == first
        sizes.add(detector.stats["gpu_bytes"])
        free.append(cupy.cuda.runtime.memGetInfo()[0])
    assert len(sizes) == 1 and abs(free[10] - free[-1]) < 4 << 20


def test_who_writes_into_them_harms_no_later_result():
    scene, t0, t1 = crumpled()
    expected = hc.Detector(scene, backend="cpu").detect(t0, t1)
    detector = settled(scene, t0, t1)
    for _ in range(4):
        found = detector.detect(t0, t1)
        assert_same(found, expected)
        for name in ROWS:
            cupy.asarray(getattr(found, name))[...] = 7
        cupy.cuda.Device().synchronize()


@pytest.mark.parametrize("results", ("host", "device"))
def test_frames_of_changing_size(results):
    scene, t0, t1 = crumpled()
    flat = scenes.flat(N)
    motions = [(t0, t1), (flat, flat), (t0, t0 + 0.2 * (t1 - t0)), (t1, t0), (flat, flat), (t0, t1)]
    cpu = hc.Detector(scene, backend="cpu")
    expected = [cpu.detect(*ends) for ends in motions]
    assert len(expected[1]) == 0 < len(expected[2]) < len(expected[0])
    detector = hc.Detector(scene, backend="gpu", results=results)
    held = []
    for ends, one in zip(motions, expected, strict=True):
        held.append(detector.detect(*ends))
        assert_same(held[-1], one)
    for found, one in zip(held, expected, strict=True):
        assert_same(found, one)
    held.clear()
    for ends, one in zip(motions, expected, strict=True):
        assert_same(detector.detect(*ends), one)
    assert_on_gpu(detector)


def test_the_core_gives_rows_where_the_detector_wants_them():
    """Else something would read on the host what is on the device."""
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(0), 20)])
    there = hc.Detector(scene, backend="gpu", results="device")._core
    for found in (there.detect(t0, t1), there.proximity(t0, 0.2), there.intersections(t1)):
        assert isinstance(found["vf"], hc.DeviceArray)
        assert not [name for name, rows in found.items() if isinstance(rows, np.ndarray)]
