# SPDX-License-Identifier: Apache-2.0
"""Thickness per face: the GPU, alone, beside the CPU and with results on the device, finds the CPU's pairs, to the last
bit."""

import numpy as np
import pytest
import scenes
from device_results import assert_on_gpu, assert_same

import hpccd_core as hc

OUTPUTS = ("points", "normals", "closest", "weights")
VALUES = np.array([0.0, 1e-9, 0.05, 0.3])


def thick_meshes(seed):
    rng = np.random.default_rng(seed)
    scene, t0, t1 = scenes.join(
        [scenes.crumpled(rng, 12), scenes.lattice(rng, 12), scenes.soup(rng, 20)],
        accuracy=((0, 1, "balanced"), (1, 2, "conservative")),
    )
    return scene, t0, t1, rng


def give(detectors, scene, rng):
    n_faces = np.diff(scene.layout.face_offsets)
    for name, n in zip(scene.mesh_names, n_faces, strict=True):
        thickness = rng.choice(VALUES, n)
        for detector in detectors:
            detector.set_thickness(name, thickness)


@pytest.mark.parametrize("backend", ("gpu", "hybrid"))
@pytest.mark.parametrize("separation", (0.0, 0.02))
@pytest.mark.parametrize("dtype", (np.float32, np.float64))
def test_detection(backend, separation, dtype):
    scene, t0, t1, rng = thick_meshes(1)
    t0, t1 = t0.astype(dtype), t1.astype(dtype)
    options = {"minimum_separation": separation, "outputs": OUTPUTS}
    cpu, other = (hc.Detector(scene, backend=b, **options) for b in ("cpu", backend))
    hashes = set()
    for _ in range(4):
        give((cpu, other), scene, rng)
        expected = cpu.detect(t0, t1)
        for _ in range(2):
            assert_same(other.detect(t0, t1), expected)
            assert_on_gpu(other)
        hashes.add(expected.hash)
        assert other.collision_free_step(t0, t1) == cpu.collision_free_step(t0, t1)
    assert len(hashes) == 4


def test_earliest():
    scene, t0, t1, rng = thick_meshes(2)
    cpu, gpu = (hc.Detector(scene, backend=b, report="first", accuracy="exact") for b in ("cpu", "gpu"))
    give((cpu, gpu), scene, rng)
    assert_same(gpu.detect(t0, t1), cpu.detect(t0, t1))
    near = t0 + 0.001 * (t1 - t0)
    for end in (near, t1, near):  # with and without a list of near pairs
        assert gpu.collision_free_step(t0, end) == cpu.collision_free_step(t0, end)


def test_proximity():
    scene, t0, _, rng = thick_meshes(3)
    cpu, gpu = (hc.Detector(scene, backend=b, outputs=("normals", "closest", "weights")) for b in ("cpu", "gpu"))
    for distance in (0.0, 0.05, 0.4):
        give((cpu, gpu), scene, rng)
        expected = cpu.proximity(t0, distance)
        assert len(expected) > 0
        assert_same(gpu.proximity(t0, distance), expected)
        assert gpu.backend == "gpu"


def test_results_on_the_device():
    scene, t0, t1, rng = thick_meshes(4)
    cpu = hc.Detector(scene, backend="cpu", outputs=OUTPUTS)
    gpu = hc.Detector(scene, backend="gpu", outputs=OUTPUTS, results="device")
    give((cpu, gpu), scene, rng)
    assert_same(gpu.detect(t0, t1), cpu.detect(t0, t1))
    cpu = hc.Detector(scene, backend="cpu", outputs=("normals",))
    gpu = hc.Detector(scene, backend="gpu", outputs=("normals",), results="device")
    give((cpu, gpu), scene, rng)
    assert_same(gpu.proximity(t0, 0.1), cpu.proximity(t0, 0.1))


def test_worlds():
    scene, t0, t1, rng = thick_meshes(5)
    starts, ends = (np.stack([t + shift for shift in (0, 5, -3)]) for t in (t0, t1))
    cpu, gpu = (hc.Detector(scene, backend=b, worlds=3, outputs=("normals",)) for b in ("cpu", "gpu"))
    give((cpu, gpu), scene, rng)
    assert_same(gpu.detect(starts, ends), cpu.detect(starts, ends))
    assert_same(gpu.proximity(starts, 0.1), cpu.proximity(starts, 0.1))
