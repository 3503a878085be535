# SPDX-License-Identifier: Apache-2.0
"""Spheres, capsules and ropes: the GPU, alone and beside the CPU, finds the CPU's pairs, to the last bit."""

import numpy as np
import pytest
import scenes
from device_results import assert_on_gpu

import hpccd_core as hc

BACKENDS = pytest.mark.parametrize("backend", ("gpu", "hybrid"))
TIERS = pytest.mark.parametrize("accuracy", ("fast", "balanced", "conservative", "exact"))
DTYPES = pytest.mark.parametrize("dtype", (np.float32, np.float64))
OUTPUTS = ("points", "normals", "closest", "weights")
KINDS = ("vf", "ee", "vv", "ve")


def assert_same(found, expected):
    for kind in KINDS:
        for name in (kind, f"{kind}_toc", f"{kind}_distance", f"{kind}_offsets"):
            if hasattr(expected, name):
                np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)
    for name in expected.outputs:
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)
    assert found.hash == expected.hash


def counts(result):
    return [len(getattr(result, kind)) for kind in KINDS]


def mixed(seed, radius, lattice=False):
    """(scene, t0, t1): spheres of their own radii, ropes that are capsules, lone vertices beside a mesh, two sheets."""
    rng = np.random.default_rng(seed)
    n_grains, n = 60, 9
    scene = hc.Scene()
    scene.add_points("grains", n_grains, thickness=rng.choice([0, 0.5, 1], n_grains) * radius)
    rope = scenes.rope(rng, 20)
    # The last vertex of the mesh of ropes is a point.
    scene.add_points("ropes", 21, edges=rope[3], thickness=radius)
    scene.add_mesh("thick", scenes.sheet(n), thickness=radius)
    scene.add_mesh("fringed", scenes.sheet(n), edges=rng.integers(0, n * n, (20, 2)))
    scene.add_points("others", n_grains)
    scene.ignore_pair("others", "ropes")
    parts = [rng.uniform(-1, n, (n_grains, 3)) * (1, 1, 0.3), np.concatenate([rope[1], np.full((1, 3), 2.0)])]
    parts += [scenes.flat(n), scenes.flat(n) + (0.3, 0.2, 0.5), rng.uniform(-1, n, (n_grains, 3)) * (1, 1, 0.3)]
    t0 = np.concatenate(parts)
    t1 = t0 + rng.normal(0, 0.6, t0.shape)
    if lattice:  # equal coordinates, points that rest on vertices, distances that are met exactly
        t0, t1 = np.round(2 * t0) / 2, np.round(2 * t1) / 2
        t0[0], t1[0] = t0[n_grains + 5], t1[n_grains + 5]  # on a rope
    return scene, t0, t1


def pile(n, dtype):
    """n spheres that fall onto each other."""
    rng = np.random.default_rng(9)
    side = round(n ** (1 / 3))
    grid = np.stack(np.meshgrid(*3 * [np.arange(side)]), axis=-1).reshape(-1, 3) * 1.02
    t0 = grid + rng.uniform(-0.2, 0.2, grid.shape)
    t1 = t0 * (1, 1, 0.97) + rng.normal(0, 0.02, t0.shape)
    scene = hc.Scene()
    scene.add_points("grains", len(grid), thickness=0.5)
    return scene, t0.astype(dtype), t1.astype(dtype)


def detectors(scene, backend, **options):
    return (hc.Detector(scene, backend=b, **options) for b in ("cpu", backend))


@BACKENDS
@TIERS
@DTYPES
@pytest.mark.parametrize("lattice", (False, True))
@pytest.mark.parametrize("radius", (0.0, 0.25))
def test_detection(backend, accuracy, dtype, lattice, radius):
    scene, t0, t1 = mixed(1, radius, lattice)
    t0, t1 = t0.astype(dtype), t1.astype(dtype)
    _, other = detectors(scene, backend, accuracy=accuracy, outputs=OUTPUTS)
    # Hybrid backends and pairs with a separation have no tests in single precision.
    balanced = accuracy == "fast" and (backend == "hybrid" or radius > 0)
    cpu = hc.Detector(scene, backend="cpu", accuracy="balanced" if balanced else accuracy, outputs=OUTPUTS)
    expected = cpu.detect(t0, t1)
    assert min(counts(expected)) > 0 or not (lattice or radius)
    for _ in range(2):  # with a new tree, and with a refitted one
        assert_same(other.detect(t0, t1), expected)
        assert_on_gpu(other)
    assert other.backend == backend
    for kind in ("vf", "ee"):  # pairs that are never tested do not count
        assert other.stats[f"{kind}_ignored"] == cpu.stats[f"{kind}_ignored"] == 0


@BACKENDS
@DTYPES
def test_a_pile_of_spheres(backend, dtype):
    scene, t0, t1 = pile(8000, dtype)
    cpu, other = detectors(scene, backend)
    expected = cpu.detect(t0, t1)
    assert len(expected.vv) > 5000
    assert_same(other.detect(t0, t1), expected)
    scene.add_mesh("floor", [[0, 1, 2]], static=True)  # and pairs that are left out
    floor = np.array([[-99, -99, -0.4], [199, -99, -0.4], [-99, 199, -0.4]], dtype)
    cpu, other = detectors(scene, backend)
    expected = cpu.detect(np.concatenate([t0, floor]), np.concatenate([t1, floor]))
    assert len(expected.vf) > 100
    assert_same(other.detect(np.concatenate([t0, floor]), np.concatenate([t1, floor])), expected)
    assert_on_gpu(other)


@BACKENDS
@TIERS
@pytest.mark.parametrize("report", ("first", "any"))
def test_reports(backend, accuracy, report):
    for seed in range(4):
        for radius in (0.0, 0.1):
            scene, t0, t1 = mixed(seed, radius, lattice=seed % 2 == 1)
            cpu, other = detectors(scene, backend, accuracy=accuracy, report=report)
            found = other.detect(t0, t1)
            assert_on_gpu(other)
            if report == "first":
                assert_same(found, cpu.detect(t0, t1))
            else:  # any one of them
                assert len(found) == len(cpu.detect(t0, t1))
                every = hc.Detector(scene, backend="cpu", accuracy=accuracy).detect(t0, t1)
                for kind in KINDS:
                    assert set(map(tuple, getattr(found, kind))) <= set(map(tuple, getattr(every, kind)))


@BACKENDS
def test_steps(backend):
    scene, t0, t1 = mixed(5, 0.02)
    cpu, other = detectors(scene, backend)
    near = t0 + 0.001 * (t1 - t0)
    for end in (near, t1, near):  # with and without a list of near pairs
        assert other.collision_free_step(t0, end) == cpu.collision_free_step(t0, end)
        assert_same(other.detect(t0, end), cpu.detect(t0, end))
    assert_on_gpu(other)


@BACKENDS
@DTYPES
@pytest.mark.parametrize("lattice", (False, True))
def test_snapshots(backend, dtype, lattice):
    scene, t0, _ = mixed(6, 0.1, lattice)
    t0 = t0.astype(dtype)
    cpu, other = detectors(scene, backend, outputs=("normals", "closest", "weights"))
    for distance in (0.0, 0.2, 0.6):
        expected = cpu.proximity(t0, distance)
        for _ in range(2):
            assert_same(other.proximity(t0, distance), expected)
    assert min(counts(expected)) > 0
    assert len(cpu.intersections(t0)) > 0
    assert other.intersections(t0) == cpu.intersections(t0)
    assert [gap.distance for gap in other.distances(t0)] == [gap.distance for gap in cpu.distances(t0)]
    assert_on_gpu(other)


@BACKENDS
def test_filters_and_features(backend):
    scene, t0, t1 = mixed(7, 0.3)
    scene.ignore_within("fringed", rings=1)
    scene.ignore_faces("thick", np.arange(20), "grains")
    for features in (None, "edge_edge", "vertex_face"):
        if features:
            scene.set_features("grains", "thick", features)
        cpu, other = detectors(scene, backend)
        assert_same(other.detect(t0, t1), cpu.detect(t0, t1))
        assert_same(other.proximity(t0, 0.2), cpu.proximity(t0, 0.2))
        assert_on_gpu(other)


@BACKENDS
def test_worlds_and_planes(backend):
    scene, t0, t1 = mixed(8, 0.2)
    scene.add_plane("floor", offset=-0.2)
    starts, ends = (np.stack([t + shift for shift in (0, 5, -3)]) for t in (t0, t1))
    cpu, other = detectors(scene, backend, worlds=3, outputs=OUTPUTS)
    expected = cpu.detect(starts, ends)
    assert min(*counts(expected), len(expected.vp)) > 0
    assert_same(other.detect(starts, ends), expected)
    assert_same(other.proximity(starts, 0.1), cpu.proximity(starts, 0.1))


@BACKENDS
@pytest.mark.parametrize("scale", (1e-150, 1e-20, 1e60))
def test_scales(backend, scale):
    scene, t0, t1 = mixed(10, 0.25 * scale, lattice=True)
    cpu, other = detectors(scene, backend)
    expected = cpu.detect(t0 * scale, t1 * scale)
    assert min(counts(expected)) > 0
    assert_same(other.detect(t0 * scale, t1 * scale), expected)
    assert_on_gpu(other)


def test_results_on_the_device_are_rejected():
    scene, _, _ = mixed(1, 0.1)
    with pytest.raises(ValueError, match="points"):
        hc.Detector(scene, backend="gpu", results="device")
