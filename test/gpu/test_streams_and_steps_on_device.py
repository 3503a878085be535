# SPDX-License-Identifier: Apache-2.0
"""Streams of the caller and streaming steps, with results that stay on the device."""

import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import scenes
from device_results import assert_on_gpu, assert_same, garments

import hpccd_core as hc

cupy = pytest.importorskip("cupy")

SPIN = r"""
extern "C" __global__ void spin(long long ticks) {
  const long long begin = clock64();
  while (clock64() - begin < ticks) {}
}
"""


@pytest.fixture(scope="module")
def spin():
    """spin(): keeps the current stream busy for some 20 ms."""
    kernel = cupy.RawKernel(SPIN, "spin")
    try:
        kernel((1,), (1,), (np.int64(1),))
    except Exception as error:  # whatever CuPy says where there is no compiler
        pytest.skip(f"CuPy compiles no kernel here: {error}")
    cupy.cuda.Device().synchronize()
    return lambda: kernel((1,), (1,), (np.int64(30_000_000),))


def crumpled(n=20):
    return scenes.join([scenes.crumpled(np.random.default_rng(0), n)])


def resting_contacts():
    """(scene, vertices) whose surfaces touch where they lie: contacts at t=0 of a motion that goes nowhere."""
    scene, vertices, _ = scenes.join([scenes.lattice(np.random.default_rng(2), 12)])
    assert len(hc.Detector(scene, backend="cpu").detect(vertices, vertices)) > 0
    return scene, vertices


@pytest.mark.parametrize("given", ("object", "number", "none"))
@pytest.mark.parametrize("results", ("host", "device"))
@pytest.mark.parametrize("worlds", (None, 3))
def test_what_a_busy_stream_has_yet_to_write_is_waited_for(spin, worlds, results, given):
    scene, t0, t1 = crumpled() if worlds is None else garments(worlds)
    expected = hc.Detector(scene, backend="cpu", worlds=worlds).detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", worlds=worlds, results=results)
    stream = cupy.cuda.Stream(non_blocking=True)
    argument = {"object": stream, "number": stream.ptr, "none": None}[given]
    there = [cupy.asarray(t0), cupy.asarray(t1)]
    ends = [cupy.zeros_like(t) for t in there]
    for _ in range(3):
        for end in ends:
            end[...] = 0
        cupy.cuda.Device().synchronize()
        with stream:
            spin()
            for end, t in zip(ends, there, strict=True):
                cupy.copyto(end, t)
        assert_same(detector.detect(*ends, stream=argument), expected)
        assert_on_gpu(detector)


def test_streams_of_torch_and_the_default_ones():
    torch = pytest.importorskip("torch")
    scene, t0, t1 = crumpled()
    cpu = hc.Detector(scene, backend="cpu")
    expected = cpu.detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", results="device")
    stream = torch.cuda.Stream()
    with torch.cuda.stream(stream):
        ends = [torch.from_numpy(t).cuda() for t in (t0, t1)]
    for given in (stream, stream.cuda_stream, torch.cuda.current_stream(), 0, 1, 2, cupy.cuda.Stream.null):
        assert_same(detector.detect(*ends, stream=given), expected)
    assert_same(detector.proximity(ends[0], 0.2, stream=stream), cpu.proximity(t0, 0.2))
    assert_same(detector.intersections(ends[1], stream=stream), cpu.intersections(t1))
    assert detector.collision_free_step(*ends, stream=stream) == cpu.collision_free_step(t0, t1)
    assert detector.distances(ends[0], stream=stream).to_host() == cpu.distances(t0)
    assert_on_gpu(detector)


@pytest.mark.parametrize("given", ("no stream", "stream"))
@pytest.mark.parametrize("where", ("device", "host"))
def test_memory_still_read_on_the_callers_stream_is_not_written(spin, where, given):
    """A result is dropped while a stream is about to read it: the next call may write there when that has ended."""
    scene, t0, t1 = crumpled()
    expected = hc.Detector(scene, backend="cpu").detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", results="device")
    ends = [cupy.asarray(t) for t in (t0, t1)]
    back = ends[::-1] if where == "device" else (t1, t0)
    for _ in range(3):
        detector.detect(*ends)
        detector.detect(*back)
    stream = cupy.cuda.Stream(non_blocking=True)
    more = {"stream": stream} if given == "stream" else {}
    for _ in range(5):
        found = detector.detect(*ends)
        taken = cupy.from_dlpack(found.ee)
        copy = cupy.empty_like(taken)
        cupy.cuda.Device().synchronize()
        with stream:
            spin()
            cupy.copyto(copy, taken)
        del found, taken
        for _ in range(3):
            detector.detect(*back, **more)
        stream.synchronize()
        np.testing.assert_array_equal(copy.get(), expected.ee)


@pytest.mark.parametrize("where", ("host", "device"))
@pytest.mark.parametrize("separation", (0.0, 0.1))
@pytest.mark.parametrize("worlds", (None, 1, 3))
def test_the_first_step_has_no_contacts(worlds, separation, where):
    """Though surfaces touch where they are given, and a motion from there to there would have contacts."""
    scene, vertices = resting_contacts()
    if worlds is not None:
        vertices = np.stack([vertices] * worlds)
    given = vertices if where == "host" else cupy.asarray(vertices)
    options = {"worlds": worlds, "minimum_separation": separation}
    detector = hc.Detector(scene, backend="gpu", results="device", **options)
    cpu = hc.Detector(scene, backend="cpu", **options)
    for _ in range(2):
        detector.reset()
        cpu.reset()
        found, expected = detector.step(given), cpu.step(vertices)
        assert len(found) == 0 and found.first_toc == np.inf and found.hash == 0
        assert_same(found, expected)
        assert_same(detector.step(given), cpu.step(vertices))


def test_steps_whose_array_the_caller_writes_anew():
    scene, t0, _ = crumpled()
    rng = np.random.default_rng(3)
    cpu = hc.Detector(scene, backend="cpu")
    detector = hc.Detector(scene, backend="gpu", results="device")
    stream = cupy.cuda.Stream(non_blocking=True)
    on_device = cupy.zeros_like(cupy.asarray(t0))
    cupy.cuda.Device().synchronize()
    held = []
    for k in range(6):
        frame = t0 + rng.normal(0, 0.3, t0.shape)
        on_device.set(frame, stream=stream)
        held.append((detector.step(on_device, stream=stream), cpu.step(frame)))
        if k == 3:
            with pytest.raises(ValueError, match=r"^vertices\[0, 0\] is NaN"):
                detector.step(cupy.asarray(np.full_like(t0, np.nan)))
    for found, expected in held:
        assert_same(found, expected)
    assert_on_gpu(detector)


def test_one_detector_asked_by_several_threads():
    """Each waits for the one before; nobody's result is another's, whoever looks at the counts meanwhile."""
    scene, t0, t1 = crumpled(14)
    motions = [(t0, t1), (t1, t0), (t0, t0 + 0.3 * (t1 - t0))]
    cpu = hc.Detector(scene, backend="cpu")
    expected = [(cpu.detect(*ends), cpu.proximity(ends[1], 0.1), cpu.intersections(ends[1])) for ends in motions]
    detector = hc.Detector(scene, backend="gpu", results="device", threads=2)
    wrong, done = [], threading.Event()

    def run(act):
        try:
            act()
        except BaseException as error:
            wrong.append(error)

    def ask(number):
        contacts, near, hits = expected[number]
        start, end = motions[number]
        for _ in range(60):
            assert_same(detector.detect(start, end), contacts)
            assert_same(detector.proximity(end, 0.1), near)
            assert_same(detector.intersections(end), hits)

    def look():
        while not done.is_set():
            assert isinstance(detector.stats, dict) and isinstance(detector.profile, dict)

    askers = [threading.Thread(target=run, args=(lambda k=k: ask(k),)) for k in range(3)]
    looker = threading.Thread(target=run, args=(look,))
    for thread in (*askers, looker):
        thread.start()
    for thread in askers:
        thread.join()
    done.set()
    looker.join()
    assert not wrong, wrong[0]


@pytest.mark.parametrize("ask", ("detect", "step"))
@pytest.mark.parametrize("results", ("host", "device"))
@pytest.mark.parametrize("worlds", (None, 3))
def test_a_named_stream_alone_is_waited_for(spin, worlds, results, ask):
    """Other work on the device goes on: no part of a settled frame waits for all of it."""
    scene, t0, t1 = crumpled() if worlds is None else garments(worlds)
    expected = hc.Detector(scene, backend="cpu", worlds=worlds).detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", worlds=worlds, results=results)
    ends = [cupy.asarray(t) for t in (t0, t1)]
    stream, other = (cupy.cuda.Stream(non_blocking=True) for _ in range(2))

    def frames():
        if ask == "detect":
            return [detector.detect(*ends, stream=stream) for _ in range(2)]
        detector.reset()
        return [detector.step(end, stream=stream) for end in ends]

    for _ in range(4):
        frames()
    if detector.stats["gpu_exact_on_cpu"]:
        pytest.skip("the CPU decides some pairs, and fetches their positions from the device")
    cupy.cuda.Device().synchronize()
    with other:
        for _ in range(100):  # some 2 s
            spin()
    found = frames()  # all are held: to give memory back waits for the device
    still_at_work = not other.done
    other.synchronize()
    assert still_at_work
    assert_same(found[-1], expected)
    assert_on_gpu(detector)


@pytest.mark.parametrize("where", ("device", "host"))
def test_a_stream_that_is_captured_is_rejected(where):
    """Its work is not done before the graph is launched. The caller's mistake: the GPU is not given up for it."""
    scene, t0, t1 = crumpled()
    expected = hc.Detector(scene, backend="cpu").detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", results="device")
    ends = [cupy.asarray(t) for t in (t0, t1)] if where == "device" else (t0, t1)
    for _ in range(2):
        detector.detect(*ends)
        detector.proximity(ends[0], 0.1)
        detector.intersections(ends[0])
    stream = cupy.cuda.Stream(non_blocking=True)
    cupy.cuda.Device().synchronize()
    with stream:
        stream.begin_capture()
        try:
            for ask in (
                lambda: detector.detect(*ends, stream=stream),
                lambda: detector.proximity(ends[0], 0.1, stream=stream),
                lambda: detector.intersections(ends[0], stream=stream),
                lambda: detector.step(ends[0], stream=stream),
            ):
                with pytest.raises(ValueError, match="^stream: is being captured .*; end the capture"):
                    ask()
        finally:
            stream.end_capture()
    assert_same(detector.detect(*ends, stream=stream), expected)
    assert_on_gpu(detector)
    assert detector.backend == "gpu"


def test_a_stream_of_another_device_is_rejected():
    if cupy.cuda.runtime.getDeviceCount() < 2:
        pytest.skip("one GPU")
    scene, t0, t1 = crumpled()
    expected = hc.Detector(scene, backend="cpu").detect(t0, t1)
    detector = hc.Detector(scene, backend="gpu", results="device")
    first = hc.gpu_status()["devices"][0]["number"]
    with cupy.cuda.Device(1 if first == 0 else 0):
        foreign = cupy.cuda.Stream(non_blocking=True)
    with cupy.cuda.Device(first):
        ends = [cupy.asarray(t) for t in (t0, t1)]
    for given in (ends, (t0, t1)):
        for _ in range(4):
            with pytest.raises(ValueError, match=f"^stream: is no stream of CUDA device {first},.* give one of that"):
                detector.detect(*given, stream=foreign)
        assert_same(detector.detect(*given), expected)
    assert_on_gpu(detector)


NO_MORE = """
import cupy, numpy as np, scenes
import hpccd_core as hc
scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(0), 20)])
detector = hc.Detector(scene, backend="gpu", results="device")
expected = detector.detect(t0, t1).hash
gone = cupy.cuda.runtime.streamCreate()
cupy.cuda.runtime.streamDestroy(gone)
for ends in ((t0, t1), [cupy.asarray(t) for t in (t0, t1)]):
    for _ in range(4):
        try:
            assert detector.detect(*ends, stream=gone).hash == expected
        except ValueError as error:
            assert str(error).startswith("stream: is no stream of CUDA device"), error
assert detector.stats.get("gpu_fallbacks", 0) == 0, detector.last_gpu_error
assert detector.detect(t0, t1).hash == expected and detector.backend == "gpu"
assert detector.stats["gpu_fallbacks"] == 0, detector.last_gpu_error
"""


def test_a_stream_that_is_no_more_never_counts_as_a_failure_of_the_gpu():
    """In a process of its own: CUDA may reject the handle, not notice, or crash."""
    folders = [Path(hc.__file__).parents[1], Path(__file__).parent]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([*map(str, folders), os.environ.get("PYTHONPATH", "")])}
    done = subprocess.run([sys.executable, "-c", NO_MORE], env=environment, capture_output=True, text=True)
    if done.returncode < 0:
        pytest.skip(f"CUDA does not survive it: signal {-done.returncode}")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("what", ("offsets", "joined", "to_host"))
def test_other_threads_of_python_go_on_while_the_device_is_waited_for(spin, what):
    scene, t0, t1 = garments(3)
    worlds = 3 if what == "joined" else None
    ends = (t0, t1) if worlds else (t0[0], t1[0])
    detector = hc.Detector(scene, backend="gpu", worlds=worlds, results="device", outputs=("points",))
    found = detector.detect(*ends)
    ask = {
        "offsets": lambda: found.vf_offsets,
        "joined": lambda: found.world(1),
        "to_host": lambda: found.ee_toc.to_host(),
    }[what]
    ask()  # what is looked up once is there
    blocking = cupy.cuda.Stream()  # the default stream waits for it
    took, done = [], threading.Event()

    def wait():
        begin = time.monotonic()
        ask()
        took.append(time.monotonic() - begin)
        done.set()

    waiting = threading.Thread(target=wait)
    cupy.cuda.Device().synchronize()
    with blocking:
        for _ in range(50):  # some 1 s
            spin()
    waiting.start()
    longest, last = 0.0, time.monotonic()
    while not done.is_set():
        now = time.monotonic()
        longest, last = max(longest, now - last), now
    waiting.join()
    assert longest < 0.5 * took[0] or took[0] < 0.1
