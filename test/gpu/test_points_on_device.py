# SPDX-License-Identifier: Apache-2.0
"""Points and closed meshes: winding numbers and signed distances of a GPU are bit-identical to those of the CPU."""

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_core import shapes


def crumpled():
    vertices, faces = shapes.icosphere(8)
    return vertices + 0.05 * np.random.default_rng(1).standard_normal(vertices.shape), faces


def on_lattice():
    vertices, faces = crumpled()
    return np.round(8 * vertices) / 8, faces


def flat():
    vertices, faces = crumpled()
    return vertices * [1, 1, 1e-12], faces


def box():
    return shapes.box()


def points_around(vertices, faces):
    """On vertices and edges, on a lattice, around the mesh, and far away."""
    rng = np.random.default_rng(2)
    around = rng.uniform(-1.3, 1.3, (3000, 3))
    far = rng.uniform(-1, 1, (500, 3)) * 10.0 ** rng.integers(-12, 12, (500, 1))
    return np.concatenate([vertices, vertices[faces[:, :2]].mean(axis=1), around, np.round(8 * around) / 8, far])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("mesh", [box, crumpled, on_lattice, flat])
def test_points_as_on_the_cpu(mesh, dtype):
    vertices, faces = mesh()
    points = points_around(vertices, faces).astype(dtype)
    scene = hc.Scene()
    scene.add_mesh("other", faces)
    scene.add_mesh("mesh", faces)
    cpu, gpu = (hc.Detector(scene, backend=backend) for backend in ("cpu", "gpu"))
    for size in (1.0, 1.01, 0.5):  # a deforming mesh: the tree is refitted
        both = np.concatenate([vertices + 0.1, size * vertices]).astype(dtype)
        numbers, on_surface = gpu.winding_numbers(both, points, "mesh")
        expected = cpu.winding_numbers(both, points, "mesh")
        assert np.array_equal(numbers, expected[0]) and np.array_equal(on_surface, expected[1])
        assert gpu.backend == "gpu" and gpu.stats["gpu_fallbacks"] == 0
        signed, on_cpu = (d.signed_distances(both, points, "mesh") for d in (gpu, cpu))
        assert np.array_equal(signed.distance, on_cpu.distance)
        assert np.array_equal(signed.faces, on_cpu.faces)
        assert np.array_equal(signed.closest, on_cpu.closest)
        assert gpu.backend == "gpu" and gpu.stats["gpu_fallbacks"] == 0


def test_invalid_coordinates_are_named():
    vertices, faces = box()
    scene = hc.Scene()
    scene.add_mesh("mesh", faces)
    detector = hc.Detector(scene, backend="gpu")
    bad = vertices.copy()
    bad[3, 1] = np.inf
    with pytest.raises(ValueError, match=r"vertices\[3, 1\]"):
        detector.winding_numbers(bad, vertices, "mesh")
    with pytest.raises(ValueError, match=r"points\[3, 1\]"):
        detector.signed_distances(vertices, bad, "mesh")
