# SPDX-License-Identifier: Apache-2.0
"""Surfaces that scenes are made of."""

import numpy as np
import pytest

from hpccd_ros.scenes import shapes


@pytest.mark.parametrize("columns, rows", [(1, 1), (3, 2), (12, 20)])
def test_a_board_is_closed_and_faces_outwards(columns, rows):
    vertices, faces = shapes.board(columns, rows)
    assert len(faces) == 4 * (columns * rows + columns + rows) and len(vertices) == faces.max() + 1
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    # Each edge is passed once in either direction.
    assert len(np.unique(edges, axis=0)) == len(edges)
    np.testing.assert_array_equal(np.unique(edges, axis=0), np.unique(edges[:, ::-1], axis=0))
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    assert (a * np.cross(b, c)).sum() / 6 == pytest.approx(4.0), "its volume"
