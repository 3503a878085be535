# SPDX-License-Identifier: Apache-2.0
"""hpccd_core.shapes: simple meshes to start with."""

import numpy as np
import pytest

import hpccd_core as hc


def assert_closed_with_volume(vertices, faces, volume, tolerance=1e-12):
    """Each edge is passed once in either direction, and faces are counterclockwise seen from outside."""
    assert vertices.dtype == np.float64 and faces.dtype == np.uint32 and len(vertices) == faces.max() + 1
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    assert len(np.unique(edges, axis=0)) == len(edges)
    np.testing.assert_array_equal(np.unique(edges, axis=0), np.unique(edges[:, ::-1], axis=0))
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    assert (a * np.cross(b, c)).sum() / 6 == pytest.approx(volume, rel=tolerance)


@pytest.mark.parametrize("frequency", [1, 2, 7])
def test_an_icosphere_is_closed_and_of_radius_one(frequency):
    vertices, faces = hc.shapes.icosphere(frequency)
    assert len(faces) == 20 * frequency**2 and len(vertices) == 10 * frequency**2 + 2
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 1.0, rtol=1e-15)
    assert_closed_with_volume(vertices, faces, 4 / 3 * np.pi, tolerance=0.6 / frequency**2)


def test_a_box_has_the_size_that_was_given():
    vertices, faces = hc.shapes.box((1.0, 2.0, 0.5))
    np.testing.assert_array_equal(np.ptp(vertices, axis=0), (1.0, 2.0, 0.5))
    assert len(vertices) == 8 and len(faces) == 12
    assert_closed_with_volume(vertices, faces, 1.0)
    flat, two = hc.shapes.box((1.0, 2.0, 0.0))
    assert len(flat) == 4 and len(two) == 2 and not flat[:, 2].any()


def test_a_grid_covers_its_square_and_faces_up():
    vertices, faces = hc.shapes.grid(5, 3)
    assert len(vertices) == 6 * 4 and len(faces) == 2 * 5 * 3
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    areas = np.cross(b - a, c - a) / 2
    assert (areas[:, 2] > 0).all() and areas[:, 2].sum() == pytest.approx(4.0)
    np.testing.assert_array_equal(faces, hc.shapes.grid_faces(5, 3))


def test_small_numpy_integers_do_not_overflow():
    for size in (np.uint8(255), np.int8(127), np.int16(300)):
        for given, expected in zip(hc.shapes.grid(size, np.int8(20)), hc.shapes.grid(int(size), 20), strict=True):
            np.testing.assert_array_equal(given, expected)


def test_a_closed_grid_is_a_torus():
    faces = hc.shapes.grid_faces(4, 6, closed=True)
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    assert faces.max() + 1 == 24 and len(np.unique(edges, axis=0)) == len(edges) == 2 * (24 + 48)


@pytest.mark.parametrize(
    "call, error, words",
    [
        (lambda: hc.shapes.grid(0, 3), ValueError, r"columns: must lie in \[1, 32768\], got 0"),
        (lambda: hc.shapes.grid(3, 2.5), TypeError, "rows: expected an integer, got float"),
        (lambda: hc.shapes.grid_faces(1, 0), ValueError, "rows: must lie in"),
        (lambda: hc.shapes.icosphere(-1), ValueError, "frequency: must lie in"),
        (lambda: hc.shapes.box(1.0), ValueError, r"size: expected shape \(3,\)"),
        (lambda: hc.shapes.box((1, -1, 1)), ValueError, r"size\[1\]: must be finite and not negative"),
        (lambda: hc.shapes.box((1, 0, 0)), ValueError, "size: at most one length may be 0"),
        (lambda: hc.shapes.box((1, 0, 5e-324)), ValueError, "size: at most one length may be 0"),
        (lambda: hc.shapes.grid_faces(2, 3, closed=True), ValueError, r"columns: must lie in \[3, 32768\], got 2"),
        (lambda: hc.shapes.grid_faces(3, 3, closed="no"), TypeError, "closed: expected True or False"),
    ],
)
def test_wrong_sizes_name_the_argument(call, error, words):
    with pytest.raises(error, match=words):
        call()
