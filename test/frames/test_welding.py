# SPDX-License-Identifier: Apache-2.0
"""Corners of loose triangles become shared vertices, and stay the same ones from frame to frame."""

import numpy as np

from hpccd_core.mesh_files.welding import joined
from hpccd_ros.frames.welding import Welding

A, B, C, D = [0.0, 0, 0], [1.0, 0, 0], [0.0, 1, 0], [1.0, 1, 0]
SQUARE = np.array([A, B, C, D, C, B])


def test_equal_points_are_one_vertex_in_the_order_of_first_use():
    first, vertex_of = joined(SQUARE)
    assert (first.tolist(), vertex_of.tolist()) == ([0, 1, 2, 3], [0, 1, 2, 3, 2, 1])
    nearly = SQUARE.copy()
    nearly[4, 1] = np.nextafter(1.0, 2.0)
    assert joined(nearly)[1].tolist() == [0, 1, 2, 3, 4, 1]
    assert joined(SQUARE * [1, 1, -1] * 1.0)[1].tolist() == [0, 1, 2, 3, 2, 1]
    signs = SQUARE.copy()
    signs[1, 1] = -0.0
    assert joined(signs)[1].tolist() == [0, 1, 2, 3, 2, 1], "-0 is 0"


def test_the_same_faces_while_they_hold():
    welding = Welding()
    vertices, faces = welding.vertices_and_faces(SQUARE)
    assert np.array_equal(vertices[faces].reshape(-1, 3), SQUARE) and faces.dtype == np.uint32
    moved = SQUARE * [1.0, 2.0, 1.0] + [0.0, 0.0, 3.0]
    vertices, again = welding.vertices_and_faces(moved)
    assert again is faces and np.array_equal(vertices[faces].reshape(-1, 3), moved)


def test_vertices_that_meet_later_stay_two():
    welding = Welding()
    _, faces = welding.vertices_and_faces(SQUARE)
    folded = np.array([A, B, C, A, C, B])
    vertices, again = welding.vertices_and_faces(folded)
    assert again is faces and vertices.tolist() == [A, B, C, A]


def test_a_tear_and_another_number_are_other_faces():
    welding = Welding()
    _, faces = welding.vertices_and_faces(SQUARE)
    torn = SQUARE + np.array([0.0, 0, 1])[None] * np.array([0, 0, 0, 1, 1, 1])[:, None]
    vertices, apart = welding.vertices_and_faces(torn)
    assert apart.tolist() == [[0, 1, 2], [3, 4, 5]] and np.array_equal(vertices, torn)
    _, kept = welding.vertices_and_faces(SQUARE)
    assert kept is apart, "what was torn does not heal by touching"
    _, one = welding.vertices_and_faces(SQUARE[:3])
    assert one.tolist() == [[0, 1, 2]]
