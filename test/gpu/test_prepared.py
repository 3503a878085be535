# SPDX-License-Identifier: Apache-2.0
"""Detections that are prepared: in graphs and out of them the same contacts as without, or none and the reason."""

import gc

import numpy as np
import pytest
import scenes
from device_results import assert_same, garments, needle_through_plates

import hpccd_core as hc

cupy = pytest.importorskip("cupy")


def crumpled(seed=0, n=24, dtype=np.float64):
    scene, t0, t1 = scenes.join([scenes.crumpled(np.random.default_rng(seed), n)])
    return scene, t0.astype(dtype), t1.astype(dtype)


def prepared(scene, t0, t1, room=2.0, **options):
    detector = hc.Detector(scene, backend="gpu", results="device", **options)
    ends = [cupy.asarray(t) for t in (t0, t1)]
    cupy.cuda.Device().synchronize()
    return detector.prepare(*ends, room=room), ends


def graph_of(detection, stream):
    with stream:
        stream.begin_capture()
        detection.enqueue(stream)
        return stream.end_capture()


def partly(t0, t1, part):
    return (t0 + part * (t1 - t0)).astype(t0.dtype)


@pytest.mark.parametrize("dtype", (np.float32, np.float64))
@pytest.mark.parametrize("report", ("all", "first"))
@pytest.mark.parametrize("accuracy", ("exact", "conservative", "balanced", "fast"))
def test_a_graph_finds_what_detect_finds(accuracy, report, dtype):
    scene, t0, t1 = crumpled(dtype=dtype)
    options = {"accuracy": accuracy, "report": report}
    cpu = hc.Detector(scene, backend="cpu", **options)
    detection, ends = prepared(scene, t0, t1, **options)
    assert_same(detection.contacts(), cpu.detect(t0, t1))
    stream = cupy.cuda.Stream(non_blocking=True)
    graph = graph_of(detection, stream)
    for part in (1.0, 0.5, 0.01, 0.8, 0.0):
        end = partly(t0, t1, part)
        ends[1].set(end, stream=stream)
        for launch in (lambda: graph.launch(stream), lambda: detection.enqueue(stream)):
            launch()
            stream.synchronize()
            expected = cpu.detect(t0, end)
            n_vf, n_ee, state = detection.counts.to_host()
            assert (n_vf, n_ee, state) == (len(expected.vf), len(expected.ee), 0)
            assert_same(detection.contacts(), expected)
            assert detection.hash.to_host()[0] == expected.hash
            assert detection.first_toc.to_host()[0] == expected.first_toc
            assert (detection.toc.to_host()[:n_vf] == expected.vf_toc).all()


@pytest.mark.parametrize("worlds", (1, 5))
def test_worlds(worlds):
    scene, t0, t1 = garments(worlds, n=12)
    cpu = hc.Detector(scene, backend="cpu", worlds=worlds)
    detection, ends = prepared(scene, t0, t1, worlds=worlds)
    stream = cupy.cuda.Stream(non_blocking=True)
    graph = graph_of(detection, stream)
    for part in (1.0, 0.3):
        end = partly(t0, t1, part)
        ends[1].set(end, stream=stream)
        graph.launch(stream)
        stream.synchronize()
        expected = cpu.detect(t0, end)
        assert_same(detection.contacts(), expected)
        if worlds > 1:
            assert (detection.vf_offsets.to_host() == expected.vf_offsets).all()
            assert_same(detection.contacts().world(1), expected.world(1))


@pytest.mark.parametrize("dtype", (np.float32, np.float64))
@pytest.mark.parametrize("worlds", (None, 3))
@pytest.mark.parametrize("outputs", (("points",), ("normals",), ("weights",), ("points", "normals", "weights")))
@pytest.mark.parametrize("separation", (0.0, 0.05))
def test_outputs_are_those_of_detect(separation, outputs, worlds, dtype):
    scene, t0, t1 = crumpled(6, dtype=dtype) if worlds is None else garments(worlds, n=12, dtype=dtype)
    if separation and outputs[0] == "points":
        outputs = (*outputs, "closest")  # of features that touch, nearest points are for integers
    options = {"outputs": outputs, "minimum_separation": separation, "worlds": worlds}
    cpu = hc.Detector(scene, backend="cpu", **options)
    there = hc.Detector(scene, backend="gpu", results="device", **options)
    detection, ends = prepared(scene, t0, t1, **options)
    stream = cupy.cuda.Stream(non_blocking=True)
    graph = graph_of(detection, stream)
    for part in (1.0, 0.3, 0.7):
        end = partly(t0, t1, part)
        ends[1].set(end, stream=stream)
        graph.launch(stream)
        stream.synchronize()
        expected, found = cpu.detect(t0, end), detection.contacts()
        assert found.outputs.keys() == expected.outputs.keys() and len(expected) > 0
        assert_same(found, expected)
        assert_same(found, there.detect(*ends).to_host())
        for name, rows in expected.outputs.items():
            array = getattr(detection, name).to_host()[: len(expected)]
            assert array.dtype == rows.dtype
            np.testing.assert_array_equal(array, rows, err_msg=name)
        if worlds:
            assert_same(found.world(1), expected.world(1))


def test_a_separation_is_that_of_the_preparation():
    scene, t0, t1 = crumpled(1)
    cpu = hc.Detector(scene, backend="cpu", minimum_separation=0.05)
    detector = hc.Detector(scene, backend="gpu", results="device", minimum_separation=0.05)
    ends = [cupy.asarray(t) for t in (t0, t1)]
    detection = detector.prepare(*ends)
    for later in (0.2, 0.0):
        detector.set_separation(0, 0, later)
        detector.detect(*ends)
        detection.enqueue()
        assert_same(detection.contacts(), cpu.detect(t0, t1))


def test_too_little_room_is_told_and_gives_no_rows():
    scene, t0, t1 = crumpled(2, 60)
    detection, ends = prepared(scene, t0, partly(t0, t1, 0.0), room=1)
    detection.enqueue()
    assert len(detection.contacts()) == 0
    ends[1].set(10 * t1[::-1].copy())
    for _ in range(2):
        detection.enqueue()
        assert detection.counts.to_host().tolist() == [0, 0, 1]
        assert detection.hash.to_host()[0] == 0 and detection.first_toc.to_host()[0] == np.inf
        with pytest.raises(RuntimeError, match="more room"):
            detection.contacts()
    ends[1].set(t0)
    detection.enqueue()
    assert len(detection.contacts()) == 0


def test_worlds_have_no_rows_either_where_there_is_too_little_room():
    scene, t0, t1 = garments(5, n=40)
    detection, ends = prepared(scene, t0, t0, room=1, worlds=5)
    ends[1].set(5 * t1[:, ::-1].copy())
    detection.enqueue()
    assert detection.counts.to_host().tolist() == [0, 0, 1]
    assert not detection.vf_offsets.to_host().any() and not detection.ee_offsets.to_host().any()
    assert np.isinf(detection.first_tocs.to_host()).all()


def test_what_needs_the_cpu_is_told():
    rng = np.random.default_rng(300)
    faces, t0, t1 = scenes.lattice(rng, 20)
    t1 = np.where(rng.random(t1.shape) < 0.2, rng.integers(-3, 4, t0.shape) * 2.0**-300, t1)
    scene, t0, t1 = scenes.join([(faces, t0, t1)])
    detection, _ = prepared(scene, t0, t1)
    assert detection.counts.to_host().tolist() == [0, 0, 2]
    with pytest.raises(RuntimeError, match="integers"):
        detection.contacts()


def test_many_pairs_of_one_feature_are_no_matter_of_room():
    scene, t0, t1 = needle_through_plates(3000)
    detection, _ = prepared(scene, t0, t1)
    assert detection.counts.to_host().tolist() == [0, 0, 8]
    with pytest.raises(RuntimeError, match="2,048"):
        detection.contacts()


def test_bad_coordinates_are_told():
    scene, t0, t1 = crumpled(3)
    detection, ends = prepared(scene, t0, t1)
    for bad in (np.nan, np.inf, 1e200):
        t = t1.copy()
        t[7, 1] = bad
        ends[1].set(t)
        detection.enqueue()
        assert detection.counts.to_host()[2] & 4
        with pytest.raises(RuntimeError, match="NaN"):
            detection.contacts()
    ends[1].set(t1)
    detection.enqueue()
    assert_same(detection.contacts(), hc.Detector(scene, backend="cpu").detect(t0, t1))
    with pytest.raises(ValueError, match=r"vertices_t1\[7, 1\]"):
        hc.Detector(scene, backend="gpu", results="device").prepare(ends[0], cupy.asarray(t))


def test_it_outlives_its_detector_and_its_arrays_outlive_it():
    scene, t0, t1 = crumpled(4)
    expected = hc.Detector(scene, backend="cpu").detect(t0, t1)
    detection, ends = prepared(scene, t0, t1)
    del ends
    gc.collect()
    for _ in range(3):
        detection.enqueue()
        assert_same(detection.contacts(), expected)
    kept = detection.contacts()
    counts = detection.counts
    del detection
    gc.collect()
    assert_same(kept, expected)
    assert counts.to_host().tolist() == [len(expected.vf), len(expected.ee), 0]


def test_beside_its_detector():
    """Each has its own memory: neither changes what the other found."""
    scene, t0, t1 = crumpled(5)
    cpu = hc.Detector(scene, backend="cpu")
    forth, back = cpu.detect(t0, t1), cpu.detect(t1, t0)
    detector = hc.Detector(scene, backend="gpu", results="device")
    ends = [cupy.asarray(t) for t in (t0, t1)]
    detection = detector.prepare(*ends)
    for _ in range(3):
        found = detector.detect(t1, t0)
        detection.enqueue()
        assert_same(found, back)
        assert_same(detection.contacts(), forth)


@pytest.mark.parametrize("n_vertices", (0, 4))
def test_nothing_to_look_at(n_vertices):
    scene = hc.Scene()
    scene.add_mesh("points", np.zeros((0, 3), np.uint32), n_vertices=n_vertices)
    for worlds in (None, 3):
        shape = (n_vertices, 3) if worlds is None else (worlds, n_vertices, 3)
        detection, _ = prepared(scene, np.zeros(shape), np.ones(shape), worlds=worlds)
        detection.enqueue()
        assert len(detection.contacts()) == 0


def test_rejected():
    scene, t0, t1 = crumpled(6, 8)
    ends = [cupy.asarray(t) for t in (t0, t1)]
    detector = hc.Detector(scene, backend="gpu", results="device")
    with pytest.raises(TypeError, match="vertices_t1: must be in the memory of the GPU"):
        detector.prepare(ends[0], t1)
    with pytest.raises(TypeError, match="float32 or both be float64"):
        detector.prepare(ends[0], ends[1].astype(np.float32))
    for room in (0.5, 1001, np.nan, -1):
        with pytest.raises(ValueError, match="room"):
            detector.prepare(*ends, room=room)
    with pytest.raises(TypeError, match="room"):
        detector.prepare(*ends, room="much")
    with pytest.raises(ValueError, match="results='device'"):
        hc.Detector(scene, backend="gpu").prepare(*ends)
    with pytest.raises(TypeError, match="stream"):
        detector.prepare(*ends).enqueue("mine")


def test_in_a_graph_of_torch():
    torch = pytest.importorskip("torch")
    scene, t0, t1 = crumpled(7)
    expected = hc.Detector(scene, backend="cpu").detect(t0, t1)
    ends = [torch.from_numpy(t).cuda() for t in (t0, t1)]
    torch.cuda.synchronize()
    detection = hc.Detector(scene, results="device").prepare(*ends)
    stream, graph = torch.cuda.Stream(), torch.cuda.CUDAGraph()
    with torch.cuda.graph(graph, stream=stream):
        detection.enqueue(stream)
    ends[1].copy_(ends[0])
    graph.replay()
    assert len(detection.contacts()) == 0
    ends[1].copy_(torch.from_numpy(t1))
    graph.replay()
    assert_same(detection.contacts(), expected)
