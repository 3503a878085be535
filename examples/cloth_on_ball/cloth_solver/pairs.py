# SPDX-License-Identifier: Apache-2.0
"""Near pairs of features as half spaces, and how the cloth is pushed and rubbed by them.

A pair keeps the normal and the weights of its nearest points from where the detector saw it. So its constraint is
linear, and cannot be satisfied on the wrong side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cloth_solver.queries import Near
from cloth_solver.setup import Setup
from hpccd_ros.scenes.exactmath import cross, dot


@dataclass(frozen=True)
class Pairs:
    """N pairs. With x (3,V): the gap along `normal` (3,N) is normal . sum of weight[k] * x[:, vertex[k]], k = 0 .. 3.

    vertex (4,N): of vertex-face pairs the vertex and the face's three, of edge-edge pairs the two edges' ends.
    compliant (N,): sum of weight^2 / mass; of_ball (N,): whether the ball is one of the two.
    """

    vertex: np.ndarray
    weight: np.ndarray
    normal: np.ndarray
    compliant: np.ndarray
    of_ball: np.ndarray

    def __len__(self) -> int:
        return len(self.compliant)

    def only(self, chosen: np.ndarray) -> Pairs:
        """The pairs `chosen`."""
        return Pairs(
            self.vertex[:, chosen],
            self.weight[:, chosen],
            self.normal[:, chosen],
            self.compliant[chosen],
            self.of_ball[chosen],
        )

    def and_those_of(self, other: Pairs) -> Pairs:
        """Both."""
        return Pairs(
            np.concatenate([self.vertex, other.vertex], axis=1),
            np.concatenate([self.weight, other.weight], axis=1),
            np.concatenate([self.normal, other.normal], axis=1),
            np.concatenate([self.compliant, other.compliant]),
            np.concatenate([self.of_ball, other.of_ball]),
        )

    def offset(self, x: np.ndarray) -> np.ndarray:
        """(3,N): from the one side's nearest point to the other's."""
        total = self.weight[0] * x[:, self.vertex[0]]
        for k in (1, 2, 3):
            total += self.weight[k] * x[:, self.vertex[k]]
        return total

    def gap(self, x: np.ndarray) -> np.ndarray:
        """(N,), along the normals."""
        offset = self.offset(x)
        return self.normal[0] * offset[0] + self.normal[1] * offset[1] + self.normal[2] * offset[2]

    @staticmethod
    def of(near: Near, faces: np.ndarray, start: np.ndarray, end: np.ndarray, setup: Setup, n_cloth: int) -> Pairs:
        """From a detector's result for the motion from `start` to `end` (V,3); faces (F,3) of the whole scene."""
        vf, ee = near.vf.astype(np.int64), near.ee.astype(np.int64)
        vertex = np.concatenate([np.column_stack([vf[:, 0], faces[vf[:, 1]]]), ee]).T.reshape(4, -1)
        toc = np.concatenate([near.vf_toc, near.ee_toc])[:, None]
        x = [(1.0 - toc) * start[v] + toc * end[v] for v in vertex]
        n, weight = len(vf), np.empty(vertex.shape)
        weight[0, :n] = 1.0
        weight[1:, :n] = -_in_triangle(near.closest[:n, 1], *(corner[:n] for corner in x[1:]))
        along_a, along_b = (
            _on_segment(near.closest[n:, side], x[2 * side][n:], x[2 * side + 1][n:]) for side in (0, 1)
        )
        weight[:, n:] = along_a - 1.0, -along_a, 1.0 - along_b, along_b
        of_ball = (vertex >= n_cloth).any(axis=0)
        compliant = np.where(vertex < n_cloth, weight * weight, 0.0).sum(axis=0) / setup.mass
        return Pairs(vertex, weight, np.ascontiguousarray(near.normals.T), compliant, of_ball)


def _in_triangle(point, a, b, c):
    """(3,N) barycentric coordinates of points (N,3) of triangles."""
    u, v, w = b - a, c - a, point - a
    normal = cross(u, v)
    area = dot(normal, normal)
    area = np.where(area > 0.0, area, 1.0)
    of_b, of_c = dot(cross(w, v), normal) / area, dot(cross(u, w), normal) / area
    return np.clip([1.0 - of_b - of_c, of_b, of_c], 0.0, 1.0)


def _on_segment(point, a, b):
    """(N,) from 0 at a to 1 at b."""
    d = b - a
    length = dot(d, d)
    return np.clip(dot(point - a, d) / np.where(length > 0.0, length, 1.0), 0.0, 1.0)
