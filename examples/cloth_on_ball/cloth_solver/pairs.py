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


@dataclass(frozen=True)
class Pairs:
    """N pairs. With x (3,V): the gap along `normal` (3,N) is normal . sum of weight[k] * x[:, vertex[k]], k = 0 .. 3.

    vertex, weight (4,N): as hpccd_core.Contacts names them, transposed.
    compliant (N,): sum of weight^2 / mass; of_ball (N,): whether the ball or the plate is one of the two.
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
    def of(near: Near, setup: Setup, n_cloth: int) -> Pairs:
        """From a detector's result, which has the vertices, weights and normals of each pair."""
        vertex, weight = np.ascontiguousarray(near.vertices.T, np.int64), np.ascontiguousarray(near.weights.T)
        movable = vertex < n_cloth
        compliant = np.where(movable, weight * weight, 0.0).sum(axis=0) / setup.mass
        return Pairs(vertex, weight, np.ascontiguousarray(near.normals.T), compliant, ~movable.all(axis=0))
