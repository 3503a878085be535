# SPDX-License-Identifier: Apache-2.0
"""Welding: equal to union-find over all pairs in rational arithmetic, whatever the distance and the coordinates."""

import time
from fractions import Fraction

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_core.mesh_files import welding

NO_FACES = np.empty((0, 3), np.uint32)


def union_find(vertices, distance):
    """The lowest vertex of the chain that each vertex belongs to."""
    exact = [[Fraction(x) for x in row] for row in vertices.tolist()]
    limit = Fraction(distance) ** 2
    root = list(range(len(exact)))

    def find(k):
        while root[k] != k:
            k = root[k]
        return k

    for b in range(len(exact)):
        for a in range(b):
            if sum((x - y) ** 2 for x, y in zip(exact[a], exact[b], strict=True)) <= limit:
                low, high = sorted((find(a), find(b)))
                root[high] = low
    return [find(k) for k in range(len(exact))]


def check(vertices, faces, distance):
    welded, triangles, index = hc.weld(vertices, faces, distance)
    roots = union_find(vertices, distance)
    first = sorted(set(roots))
    assert index.tolist() == [first.index(root) for root in roots]
    assert welded.dtype == vertices.dtype and np.array_equal(welded.view(np.uint8), vertices[first].view(np.uint8))
    new = [[int(index[v]) for v in face] for face in faces.tolist()]
    assert triangles.tolist() == [face for face in new if len(set(face)) == 3] and triangles.dtype == np.uint32
    return len(first)


def scenes(random):
    """Coordinates and a distance that they meet exactly, nearly, or not at all."""
    n = int(random.integers(1, 50))
    lattice = random.integers(-4, 5, (n, 3))
    yield lattice * 0.125, 0.125
    yield lattice * 0.1, 0.1
    yield lattice * 0.1, float(np.sqrt(0.02))  # diagonals of a cell
    yield lattice * np.float32(0.3), 0.0
    yield random.normal(size=(n, 3)), float(random.choice([0.05, 0.3, 1.0]))
    yield random.normal(size=(n, 3)).astype(np.float32), 0.2
    yield random.normal(size=(n, 3)) * [1, 1, 0] + [0, 0, 1e9], 0.2
    yield lattice * 1e17 + 1e18, 1e-3
    yield lattice * 5e-324, float(random.choice([5e-324, 1.5e-323]))
    yield lattice * 1e-160, 1e-160
    yield lattice * 2e149, 2e149
    yield lattice * 1.0 + random.choice([0.0, -0.0, 1e-9], (n, 3)), 2e-9
    clusters = random.normal(size=(4, 3))[random.integers(0, 4, n)]
    yield clusters + 0.01 * random.normal(size=(n, 3)), 0.05
    yield np.cumsum(np.full((n, 3), 0.5773502691896257), axis=0), 1.0  # a chain
    layers = random.integers(0, 8, (2 * n, 3)) * [0.0625, 0.0625, 0] + [0, 0, 1] * random.integers(0, 3, (2 * n, 1))
    yield layers * [1, 1, float(random.choice([1 - 2**-53, 1, 1 + 2**-52]))], 1.0
    yield layers * [1, 1, 1.5] @ np.linalg.qr(random.normal(size=(3, 3)))[0], 1.49


@pytest.mark.parametrize("dense", [16, 0], ids=["as_usual", "by_a_tree"])
@pytest.mark.parametrize("seed", range(12))
def test_equals_union_find_in_rational_arithmetic(seed, dense, monkeypatch):
    monkeypatch.setattr(welding, "_DENSE", dense)
    random = np.random.default_rng(seed)
    for vertices, distance in scenes(random):
        check(vertices, random.integers(0, len(vertices), (2 * len(vertices), 3)), distance)


def test_signs_of_zero_and_the_order_of_numbers():
    vertices = np.array([[2.0, 0, 0], [0.0, 0, 0], [2.0, -0.0, 0], [-0.0, 0, -0.0]])
    welded, _, index = hc.weld(vertices, NO_FACES)
    assert index.tolist() == [0, 1, 0, 1] and welded.tolist() == [[2, 0, 0], [0, 0, 0]]
    welded, _, index = hc.weld([[0.0, 0, 0]], NO_FACES)
    assert index.tolist() == [0] and welded.tolist() == [[0, 0, 0]]
    for distance in (0.0, 1.0):
        welded, faces, index = hc.weld(np.empty((0, 3)), NO_FACES, distance)
        assert welded.shape == faces.shape == (0, 3) and index.shape == (0,)


def test_a_garment_of_two_panels_moves_freely_once_its_seam_is_welded():
    vertices, faces = hc.shapes.grid(6, 6)
    panels = np.vstack([vertices, vertices + [np.ptp(vertices[:, 0]), 0, 0]])
    both = np.vstack([faces, faces + np.uint32(len(vertices))])

    def free(vertices, faces):
        scene = hc.Scene()
        scene.add_mesh("garment", faces, n_vertices=len(vertices))
        return hc.Detector(scene).collision_free_step(vertices, vertices + [0, 0, 1.0])

    assert free(panels, both) == 0
    welded, triangles, _ = hc.weld(panels, both, 1e-9)
    assert len(triangles) == len(both) and len(panels) - len(welded) == np.sqrt(len(vertices))
    assert free(welded, triangles) == 1


@pytest.mark.parametrize("distance", [1e-6, 1.1e-3, 0.1], ids=["doubled", "beyond the spacing", "much larger"])
def test_time_grows_with_the_vertices_only(distance):
    """A distance that joins everything must not compare all pairs."""
    vertices, _ = hc.shapes.grid(299, 299)
    vertices = vertices / np.ptp(vertices[:, 0]) * 0.299
    doubled = np.concatenate([vertices, vertices + 1e-8])
    start = time.process_time()
    welded, _, _ = hc.weld(doubled, NO_FACES, distance)
    assert time.process_time() - start < 10  # about 0.2 s; all pairs take minutes
    assert len(welded) == (len(vertices) if distance < 1e-3 else 1)


@pytest.mark.parametrize("apart", [0.8, 0.500001], ids=["far", "just too far"])
def test_clusters_that_remain_apart_do_not_compare_all_pairs(apart):
    vertices, _ = hc.shapes.grid(149, 149)
    layers = np.concatenate([0.75 * vertices, 0.75 * vertices + [0, 0, apart]])
    start = time.process_time()
    welded, _, _ = hc.weld(layers, NO_FACES, 0.5)
    assert time.process_time() - start < 5  # about 0.3 s; 30 to 42 s as long as pairs of points were tested
    assert len(welded) == 2


@pytest.mark.parametrize(
    "given, error, message",
    [
        ({"vertices": [[0, 0, 0]]}, TypeError, "vertices: expected float32 or float64"),
        ({"vertices": np.zeros((3, 2))}, ValueError, r"vertices: expected shape \(K, 3\)"),
        ({"vertices": np.full((3, 3), np.nan)}, ValueError, "vertices.* is nan"),
        ({"faces": [[0, 1, 3]]}, ValueError, r"faces\[0, 2\] is 3, but there are 3 vertices"),
        ({"faces": [[0.0, 1, 2]]}, TypeError, "faces: expected integers"),
        ({"distance": -1.0}, ValueError, "distance: must be finite and not negative"),
        ({"distance": np.inf}, ValueError, "distance: must be finite"),
        ({"distance": "1"}, TypeError, "distance: expected a number"),
    ],
)
def test_errors_name_the_argument(given, error, message):
    with pytest.raises(error, match=message):
        hc.weld(**({"vertices": np.zeros((3, 3)), "faces": [[0, 1, 2]]} | given))
