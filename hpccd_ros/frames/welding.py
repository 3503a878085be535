# SPDX-License-Identifier: Apache-2.0
"""Joins corners of loose triangles at equal positions to one vertex. No ROS."""

import numpy as np
from numpy.typing import NDArray

from hpccd_core.mesh_files.welding import joined


class Welding:
    """For a stream of the same triangles: found in the first frame, and kept while joined corners stay together.

    Vertices that meet later stay separate: a mesh that touches itself keeps its topology, and its contact is found.
    """

    def __init__(self) -> None:
        self._first = np.empty(0, np.intp)
        self._vertex_of = np.empty(0, np.intp)
        self._faces = np.empty((0, 3), np.uint32)

    def vertices_and_faces(self, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
        """points: (3 F, 3), finite, the corners of F triangles. The faces are the same array as long as they are
        valid."""
        vertices = points[self._first] if len(points) == len(self._vertex_of) else None
        if vertices is None or not np.array_equal(vertices[self._vertex_of], points):
            self._first, self._vertex_of = joined(points)
            self._faces = self._vertex_of.astype(np.uint32).reshape(-1, 3)
            vertices = points[self._first]
        return vertices, self._faces
