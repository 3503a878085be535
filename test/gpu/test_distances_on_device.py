# SPDX-License-Identifier: Apache-2.0
"""Distances with results="device": the CPU's gaps, in arrays that CuPy and PyTorch take in place."""

import time

import numpy as np
import pytest
import scenes
from device_results import assert_on_gpu, garments

import hpccd_core as hc
from hpccd_core import _core

cupy = pytest.importorskip("cupy")

FIELDS = ("distance", "kind", "features", "points", "vertices", "weights", "normal", "inside")


def crumpled():
    rng = np.random.default_rng(4)
    scene, t0, _ = scenes.join([scenes.crumpled(rng, 12) for _ in range(3)])
    return scene, t0 + np.repeat([[0.0, 0, 0], [0, 0, 3], [0, 0, 40]], 144, axis=0)


def spheres():
    (ball, ball_faces), (box, box_faces) = hc.shapes.icosphere(8), hc.shapes.box()
    scene = hc.Scene()
    scene.add_mesh("ball", ball_faces, shape=ball)
    scene.add_mesh("box", box_faces, shape=0.2 * box)
    scene.add_mesh("still", ball_faces, shape=ball + [2.2, 0, 0], static=True)
    return scene


def poses(n, seed=5):
    rng = np.random.default_rng(seed)
    turns = rng.normal(size=(n, 2, 4))
    return np.concatenate([rng.normal(size=(n, 2, 3)), turns / np.linalg.norm(turns, axis=2)[:, :, None]], axis=2)


def addresses(found):
    return [getattr(found, name).__cuda_array_interface__["data"][0] for name in FIELDS]


@pytest.mark.parametrize("dtype", (np.float32, np.float64))
def test_as_on_the_host(dtype):
    scene, vertices = crumpled()
    vertices = vertices.astype(dtype)
    expected = hc.Detector(scene, backend="cpu").distances(vertices)
    detector = hc.Detector(scene, backend="gpu", results="device")
    for given in (vertices, cupy.asarray(vertices)):
        for _ in range(2):
            found = detector.distances(given)
            assert_on_gpu(detector)
            assert type(found) is hc.DeviceDistances and found.to_host() == expected
    assert cupy.asarray(found.distance).get().tolist() == [gap.distance for gap in expected]
    assert [found.KINDS[k] for k in cupy.asarray(found.kind).get()] == [gap.kind for gap in expected]
    first = addresses(found)[0]
    assert all(first <= at < first + 152 * len(expected) for at in addresses(found)), "one allocation"
    assert found == detector.distances(vertices) and found != detector.distances(2 * vertices)
    assert addresses(found) != addresses(detector.distances(vertices)), "a held result is not written"


def test_pytorch_takes_every_array():
    torch = pytest.importorskip("torch")
    scene, vertices = crumpled()
    found = hc.Detector(scene, results="device").distances(vertices)
    for name in FIELDS:
        array = getattr(found, name)
        assert torch.from_dlpack(array).data_ptr() == array.__cuda_array_interface__["data"][0]
        np.testing.assert_array_equal(torch.from_dlpack(array).cpu().numpy(), array.to_host(), err_msg=name)


def test_worlds():
    scene, vertices, _ = garments(9)
    expected = hc.Detector(scene, backend="cpu", worlds=9).distances(vertices)
    detector = hc.Detector(scene, backend="gpu", worlds=9, results="device")
    stream = cupy.cuda.Stream(non_blocking=True)
    with stream:
        there = cupy.asarray(vertices)
    for given, more in ((vertices, {}), (there, {}), (there, {"stream": stream})):
        found = detector.distances(given, **more)
        assert_on_gpu(detector)
        assert found.to_host() == expected
    assert found.points.shape == (9, len(found.pairs), 2, 3)
    row = found.world(7)
    assert row.to_host() == expected[7] and row.distance.shape == (len(found.pairs),)
    assert addresses(row)[0] == addresses(found)[0] + 7 * 8 * len(found.pairs)
    kept = cupy.asarray(row.points)
    del found, row, detector
    assert kept.get().tolist() == [gap.points.tolist() for gap in expected[7]]


def test_positions_that_the_callers_stream_still_writes():
    scene, vertices = crumpled()
    expected = hc.Detector(scene, backend="cpu").distances(vertices)
    detector = hc.Detector(scene, backend="gpu", results="device")
    detector.distances(vertices)
    there, source = cupy.zeros_like(cupy.asarray(vertices)), cupy.asarray(vertices)
    stream = cupy.cuda.Stream(non_blocking=True)
    with stream:
        a = cupy.random.random((3000, 3000))
        for _ in range(20):
            a = a @ a / 3000
        there[:] = source
        assert detector.distances(there, stream=stream).to_host() == expected


@pytest.mark.parametrize("backend", ("auto", "gpu"))
def test_meshes_at_poses(backend):
    scene, of_worlds = spheres(), poses(6)
    cpu = hc.Detector(scene, backend="cpu")
    detector = hc.Detector(scene, backend=backend, results="device")
    for of_frame in of_worlds:
        expected = cpu.distances(poses=of_frame)
        assert detector.distances(poses=of_frame).to_host() == expected
        if backend == "gpu":
            assert_on_gpu(detector)
            assert detector.backend == "gpu" and "node_pairs" not in detector.stats  # the search by poses
        assert detector.distances(cpu.positions_at(of_frame)).to_host() == expected
    many = hc.Detector(scene, backend=backend, worlds=6, results="device")
    expected = hc.Detector(scene, backend="cpu", worlds=6).distances(poses=of_worlds)
    assert many.distances(poses=of_worlds).to_host() == expected


def test_other_queries_by_poses_are_those_of_the_positions():
    scene, (of_frame,) = spheres(), poses(1)
    cpu, detector = hc.Detector(scene, backend="cpu"), hc.Detector(scene, results="device")
    assert detector.intersections(poses=of_frame).hash == cpu.intersections(poses=of_frame).hash
    assert detector.proximity(distance=0.5, poses=of_frame).hash == cpu.proximity(distance=0.5, poses=of_frame).hash


def test_a_result_may_be_dropped_while_a_graph_is_captured():
    scene, vertices = crumpled()
    found = hc.Detector(scene, results="device").distances(vertices)
    there, stream = cupy.zeros(3), cupy.cuda.Stream(non_blocking=True)
    there += 1
    cupy.cuda.Device().synchronize()
    with stream:
        stream.begin_capture()
        there += 1
        del found
        graph = stream.end_capture()
        graph.launch(stream)
    stream.synchronize()
    assert there.get().tolist() == [2, 2, 2]


def test_freeing_a_result_does_not_keep_a_host_function_from_python():
    scene, vertices = crumpled()
    found = hc.Detector(scene, results="device").distances(vertices)
    stream, called = cupy.cuda.Stream(non_blocking=True), []
    stream.launch_host_func(lambda wait: (wait(0.2), called.append(1)), time.sleep)
    del found
    stream.synchronize()
    assert called


def test_an_array_without_axes_has_no_length():
    scene = hc.Scene()
    for name in "ab":
        scene.add_mesh(name, [[0, 1, 2]], self_collision=False)
    found = hc.Detector(scene, worlds=1, results="device").distances(np.eye(3)[[0, 1, 2, 0, 1, 2]][None])
    one = found.distance.row(0).row(0)
    with pytest.raises(TypeError, match="axes"):
        len(one)
    with pytest.raises(TypeError, match="axes"):
        one.joined(one)
    for k in (-1, 1, 2**63 - 1):
        with pytest.raises(IndexError, match="row"):
            found.distance.row(k)


def test_thickness():
    scene, vertices = crumpled()
    cpu, there = hc.Detector(scene, backend="cpu"), hc.Detector(scene, results="device")
    for detector in (cpu, there):
        detector.set_thickness(0, 0.5)
    assert there.distances(vertices).to_host() == cpu.distances(vertices)


def test_no_pairs():
    scene = hc.Scene()
    scene.add_mesh("one", [[0, 1, 2]], self_collision=False)
    for worlds, shape, expected in ((None, (3, 3), []), (2, (2, 3, 3), [[], []])):
        found = hc.Detector(scene, backend="gpu", worlds=worlds, results="device").distances(np.zeros(shape))
        assert found.to_host() == expected and cupy.asarray(found.distance).size == 0


def test_a_failure_of_the_device_is_finished_by_the_cpu():
    scene, vertices = crumpled()
    expected = hc.Detector(scene, backend="cpu").distances(vertices)
    failures = 0
    for n in range(1, 400):
        # Asked again below: what a failure has left must not be taken for complete.
        detector = hc.Detector(scene, backend="gpu", threads=2, results="device")
        _core.gpu_fail_after(n)
        try:
            found = detector.distances(vertices)
        except RuntimeError as error:  # it was the copy of the result
            assert "asked for by a test" in str(error)
            found = None
        _core.gpu_fail_after(0)
        by_the_device = not detector.stats["gpu_fallbacks"]
        assert detector.distances(vertices).to_host() == expected
        if found is not None:
            assert found.to_host() == expected
            if by_the_device:
                break
        failures += 1
    assert failures > 10
    assert found is not None


def test_bad_coordinates_are_named():
    scene, vertices = crumpled()
    vertices[3, 1] = np.nan
    with pytest.raises(ValueError, match=r"^vertices\[3, 1\] is NaN"):
        hc.Detector(scene, results="device").distances(cupy.asarray(vertices))


def test_gradients_for_pytorch():
    torch = pytest.importorskip("torch")
    from hpccd_core import torch as hct

    scene, vertices = crumpled()
    values = []
    for options in ({"backend": "cpu"}, {"results": "device"}):
        x = torch.from_numpy(vertices).requires_grad_()
        distances, gaps = hct.smallest_distances(hc.Detector(scene, **options), x)
        distances[torch.isfinite(distances)].sum().backward()
        values.append((distances.detach().numpy(), x.grad.numpy()))
    assert type(gaps) is hc.DeviceDistances
    for of_cpu, of_device in zip(*values, strict=True):
        np.testing.assert_array_equal(of_cpu, of_device)
