# SPDX-License-Identifier: Apache-2.0
"""Where results lie and which stream is meant: what is rejected, in words that name the argument and the remedy."""

import numpy as np
import pytest
import random_scenes

import hpccd_core as hc
from hpccd_core import device_arrays, device_results, devices


@pytest.fixture
def meshes():
    return random_scenes.combine(random_scenes.crumpled_sheet(np.random.default_rng(1)))


@pytest.fixture
def no_gpu():
    if "gpu" in hc.backends():
        pytest.skip("a GPU is usable here")


@pytest.fixture
def as_if_there_were_a_gpu(monkeypatch):
    """For what is rejected before anybody looks there."""
    from hpccd_core import detector

    monkeypatch.setattr(detector, "backends", lambda: ["cpu", "gpu", "hybrid"])


def test_on_the_host_by_default(meshes):
    scene = meshes.scene()
    for options in ({}, {"results": "host"}):
        detector = hc.Detector(scene, backend="cpu", **options)
        assert detector.results == "host"
        found = detector.detect(meshes.vertices_t0, meshes.vertices_t1)
        assert type(found) is hc.Contacts and type(found.vf) is np.ndarray
        assert type(detector.proximity(meshes.vertices_t0, 0.1)) is hc.Proximity
        assert type(detector.intersections(meshes.vertices_t0)) is hc.Intersections


@pytest.mark.parametrize("backend", ("auto", "cpu"))
def test_on_the_device_needs_one(meshes, no_gpu, backend):
    with pytest.raises(ValueError, match=r"^results: 'device' needs a usable GPU, .*use results='host'"):
        hc.Detector(meshes.scene(), results="device", backend=backend)


def test_the_reason_is_told(meshes, no_gpu):
    reason = hc.gpu_status()["reason"]
    with pytest.raises(ValueError) as told:
        hc.Detector(meshes.scene(), results="device")
    assert reason and reason in str(told.value)


@pytest.mark.parametrize("backend", ("cpu", "hybrid"))
def test_backends_whose_results_are_on_the_host(meshes, as_if_there_were_a_gpu, backend):
    remedy = f"^results: 'device' is not offered by backend '{backend}'; use backend='gpu' or 'auto'"
    with pytest.raises(ValueError, match=remedy):
        hc.Detector(meshes.scene(), results="device", backend=backend)


@pytest.mark.parametrize("method", ("published", "naive", "front"))
def test_methods_that_run_on_cpus(meshes, as_if_there_were_a_gpu, method):
    for backend in ("auto", "gpu"):
        with pytest.raises(ValueError, match=f"^results: 'device' is not offered by method '{method}'"):
            hc.Detector(meshes.scene(), results="device", backend=backend, method=method)


@pytest.mark.parametrize("value", (1, True, None, b"host", ("host",), 1.5, object()))
def test_no_word(meshes, value):
    with pytest.raises(TypeError, match="^results: expected a string, got .*; use one of host, device"):
        hc.Detector(meshes.scene(), results=value)


@pytest.mark.parametrize("value", ("cheese", "", "Device", "host ", "gpu", "cuda"))
def test_no_such_place(meshes, value):
    with pytest.raises(ValueError, match=r"^results: '.*' is not known; use one of host, device"):
        hc.Detector(meshes.scene(), results=value)


@pytest.mark.parametrize("method", (1, "cheese"))
def test_another_argument_is_named_where_that_one_is_wrong(meshes, as_if_there_were_a_gpu, method):
    with pytest.raises((TypeError, ValueError), match="^method: "):
        hc.Detector(meshes.scene(), results="device", backend="gpu", method=method)


def questions(detector, a, b):
    return {
        "detect": lambda s: detector.detect(a, b, stream=s),
        "collision_free_step": lambda s: detector.collision_free_step(a, b, stream=s),
        "proximity": lambda s: detector.proximity(a, 0.1, stream=s),
        "intersections": lambda s: detector.intersections(a, stream=s),
        "distances": lambda s: detector.distances(a, stream=s),
        "step": lambda s: detector.step(a, stream=s),
    }


QUESTIONS = tuple(questions(None, None, None))


class Stream:
    """As CuPy's."""

    def __init__(self, number):
        self.ptr = number

    def __repr__(self):  # names tests: without an address, the same in each process
        return f"Stream({self.ptr})"


class TorchStream:
    """As PyTorch's and Warp's."""

    def __init__(self, number):
        self.cuda_stream = number

    def __repr__(self):
        return f"TorchStream({self.cuda_stream})"


GOOD = (None, 0, 1, 2, 94_000_000_000_000, np.int64(3), np.uint64(2**64 - 1), Stream(0), Stream(7), TorchStream(8))
NO_NUMBER = (True, False, 1.5, "x", "1", b"1", [1], (1,), object(), Stream(None), Stream(1.5), TorchStream("1"), Stream)


@pytest.mark.parametrize("ask", QUESTIONS)
def test_streams_of_host_arrays(meshes, ask):
    """There is nothing to wait for, and no harm in saying so."""
    a, b = meshes.vertices_t0, meshes.vertices_t1
    detector, plain = (hc.Detector(meshes.scene(), backend="cpu") for _ in range(2))
    expected = questions(plain, a, b)[ask](None)
    for stream in GOOD:
        found = questions(detector, a, b)[ask](stream)
        detector.reset()
        assert found == expected if ask == "collision_free_step" else len(found) == len(expected)


@pytest.mark.parametrize("ask", QUESTIONS)
@pytest.mark.parametrize("stream", NO_NUMBER, ids=lambda s: type(s).__name__)
def test_no_stream(meshes, ask, stream):
    detector = hc.Detector(meshes.scene(), backend="cpu")
    with pytest.raises(TypeError, match="^stream: expected a cudaStream_t as an integer, or an object with .ptr"):
        questions(detector, meshes.vertices_t0, meshes.vertices_t1)[ask](stream)


@pytest.mark.parametrize("ask", QUESTIONS)
@pytest.mark.parametrize("stream", (-1, 2**64, 10**30, Stream(-1), TorchStream(-5), np.int64(-2)), ids=str)
def test_no_address(meshes, ask, stream):
    detector = hc.Detector(meshes.scene(), backend="cpu")
    with pytest.raises(ValueError, match="^stream: a cudaStream_t is an address"):
        questions(detector, meshes.vertices_t0, meshes.vertices_t1)[ask](stream)


def test_numbers_of_streams():
    for stream, number in ((None, None), (0, 0), (Stream(5), 5), (TorchStream(6), 6), (Stream(TorchStream(7)), 7)):
        assert device_arrays.stream_number(stream) == number
    assert type(device_arrays.stream_number(np.int64(3))) is int


@pytest.mark.parametrize("dtype", (np.float32, np.float64))
def test_arrays_on_the_host_reach_the_core_with_their_stream(meshes, dtype):
    a, b = (v.astype(dtype) for v in (meshes.vertices_t0, meshes.vertices_t1))
    core = hc.Detector(meshes.scene(), backend="cpu")._core
    assert device_arrays.on_host(a, None) is a
    held = [device_arrays.on_host(v.copy(), 3) for v in (a, b)]  # the only one to hold them
    assert core.detect(*held)["hash"] == core.detect(a, b)["hash"]


class There:
    """A DeviceArray, for what is done with any without looking into it."""

    device = 0

    def __init__(self, values):
        self.values = np.array(values)

    def seen_as(self, kind):
        return There(self.values.view(f"<{kind}8"))


@pytest.mark.parametrize("time", (0.0, 0.1, 1.0, np.inf))
def test_first_tocs_of_one_world_on_a_device(monkeypatch, time):
    monkeypatch.setattr(
        device_results, "integers_on_device", lambda numbers, device: There(np.array(numbers, np.int64))
    )
    rows = dict.fromkeys(("vf", "ee", "vf_toc", "ee_toc"), There([]))
    contacts = hc.DeviceContacts(**rows, first_toc=time, hash=0, slices=None, layout=None, outputs={})
    times = contacts.first_tocs.values
    assert not hasattr(contacts, "points")
    assert times.dtype == np.float64 and times.tolist() == [time]


def test_arrays_on_a_device_still_need_one(meshes):
    class OnDevice:
        __cuda_array_interface__ = {
            "shape": meshes.vertices_t0.shape,
            "typestr": "<f8",
            "data": (4096, False),
            "version": 3,
        }

    detector = hc.Detector(meshes.scene(), backend="cpu")
    with pytest.raises(ValueError, match="is in a GPU's memory, which this detector does not use; copy it"):
        detector.detect(OnDevice(), OnDevice(), stream=3)


def test_names_are_found_where_they_are_promised():
    on_device = ("DeviceArray", "DeviceContacts", "DeviceDistances", "DeviceIntersections", "DeviceProximity")
    for name in ("Contacts", "Detector", *on_device):
        assert name in hc.__all__ and hasattr(hc, name)
    for name in hc.__all__:
        assert hasattr(hc, name)
    assert devices.backends is hc.backends
