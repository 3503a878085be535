# SPDX-License-Identifier: Apache-2.0
"""Properties of winding numbers: independent of orders, axes and subdivision; additive over components."""

import numpy as np
import pytest
from fuzz.solid_scenes import POINTS_OF_A_MESH, WINDING_POINTS, WINDING_SCENES, joined

import hpccd_core as hc

KINDS = pytest.mark.parametrize("kind", WINDING_SCENES)


def numbers_in(faces, vertices, points):
    scene = hc.Scene()
    scene.add_mesh("mesh", faces, n_vertices=len(vertices))
    return hc.Detector(scene, backend="cpu", threads=1).winding_numbers(vertices, points, "mesh")


def on_a_lattice(kind, seed):
    """Faces, vertices and points of several deformations; few bits, so that middles of edges are exact."""
    scenes = WINDING_POINTS[kind]
    for place in ("lattice", "shaped"):
        rows = scenes[place](np.random.default_rng(seed), 8 * POINTS_OF_A_MESH)
        for group in np.split(rows, 8):
            vertices, points = group[0, :-1], group[:, -1]
            if np.abs(vertices).max() < 100 and (vertices * 1024 % 1 == 0).all():
                yield WINDING_SCENES[kind].faces[0], vertices, points


def same(first, second):
    return all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))


def divided(faces, vertices):
    """Each face becomes four, at the middles of its edges."""
    a, b, c = vertices[faces].transpose(1, 0, 2)
    middles = np.concatenate([(a + b) / 2, (b + c) / 2, (c + a) / 2])
    ends = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    _, first, number = np.unique(ends, axis=0, return_index=True, return_inverse=True)
    ab, bc, ca = number.reshape(3, -1) + len(vertices)
    i, j, k = faces.T
    finer = np.concatenate([np.stack(f, 1) for f in ((i, ab, ca), (ab, j, bc), (ca, bc, k), (ab, bc, ca))])
    return finer, np.concatenate([vertices, middles[first]])


@KINDS
def test_orders_do_not_matter(kind):
    rng = np.random.default_rng(1)
    for faces, vertices, points in on_a_lattice(kind, 1):
        expected = numbers_in(faces, vertices, points)
        order, places = rng.permutation(len(vertices)), rng.permutation(len(faces))
        renamed = np.argsort(order)[faces[places]]
        turned = np.array([np.roll(f, rng.integers(3)) for f in renamed])
        assert same(numbers_in(turned, vertices[order], points), expected)
        numbers, on_surface = numbers_in(faces[:, ::-1], vertices, points)
        assert same((-numbers, on_surface), expected)


@pytest.mark.parametrize("kind", [kind for kind in WINDING_SCENES if kind != "pillow"])  # new edges would coincide
def test_finer_faces_do_not_matter(kind):
    for faces, vertices, points in on_a_lattice(kind, 2):
        assert same(numbers_in(*divided(faces, vertices), points), numbers_in(faces, vertices, points))


@KINDS
def test_turning_the_axes_does_not_matter(kind):
    """Rays along another axis, and with the opposite direction."""
    for faces, vertices, points in on_a_lattice(kind, 3):
        expected = numbers_in(faces, vertices, points)
        for axes in ([1, 2, 0], [2, 0, 1]):
            assert same(numbers_in(faces, vertices[:, axes], points[:, axes]), expected)
        numbers, on_surface = numbers_in(faces, -vertices, -points)
        assert same((-numbers, on_surface), expected)


@pytest.mark.parametrize("other", ["tetrahedron", "torus", "several"])
@KINDS
def test_components_add_up(kind, other):
    scenes = zip(on_a_lattice(kind, 4), on_a_lattice(other, 5), strict=False)
    for (faces, vertices, points), (more_faces, more_vertices, more_points) in scenes:
        points = np.concatenate([points, more_points])
        both = numbers_in(*joined((faces, vertices), (more_faces, more_vertices)), points)
        parts = [numbers_in(faces, vertices, points), numbers_in(more_faces, more_vertices, points)]
        on = parts[0][1] | parts[1][1]
        assert np.array_equal(both[1], on)
        assert np.array_equal(both[0][~on], (parts[0][0] + parts[1][0])[~on])
