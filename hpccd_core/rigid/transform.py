# SPDX-License-Identifier: Apache-2.0
"""Rigid motions of 3D space: a unit quaternion x y z w, then a translation. No ROS.

Sums are written out and sines are those of the C library: matrix products and numpy's own sines have other last bits on
other processors, and a recording must be computed again to the same contacts anywhere. The core does the same for the
joints of robots, bit-identical: hpccd_core/src/rigid/pose.h.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hpccd_core.rigid.rounding import dot

# Quaternions come rounded, often to float32 or to a few digits: within this they are taken as of unit length.
_LENGTH_TOLERANCE = 1e-3


@dataclass(frozen=True, eq=False)
class Rigid:
    """A rigid transform: rotation, then translation. x -> R x + shift.

    Attributes
    ----------
    quaternion : ndarray, shape (4,), float64
        Unit quaternion x y z w of the rotation.
    shift : ndarray, shape (3,), float64
        Translation, in the unit of the coordinates.
    """

    quaternion: NDArray[np.float64]
    shift: NDArray[np.float64]

    @classmethod
    def of(cls, shift: Sequence[float], quaternion: Sequence[float]) -> "Rigid":
        """The transform of a translation and a quaternion, which are checked.

        Parameters
        ----------
        shift : sequence of 3 float
        quaternion : sequence of 4 float
            x y z w, of length 1 within 1e-3; it is normalised.

        Raises
        ------
        ValueError
            If there are not 3 and 4 finite numbers, or the quaternion has another length.
        """
        way, turn = np.array(shift, np.float64), np.array(quaternion, np.float64)
        if way.shape != (3,) or turn.shape != (4,) or not np.isfinite([*way, *turn]).all():
            raise ValueError("needs 7 finite numbers: x y z, quaternion x y z w")
        length = _length(turn)
        if abs(length - 1.0) > _LENGTH_TOLERANCE:
            raise ValueError(f"the quaternion {turn.tolist()} has length {length:.4g}; it must be 1")
        return cls(turn / length, way)

    def apply(self, vertices: NDArray[np.float64]) -> NDArray[np.float64]:
        """Transformed vertices, (n, 3) float64. The identity returns the array itself."""
        vertices = np.asarray(vertices)
        if not self.quaternion[:3].any():
            return vertices + self.shift if self.shift.any() else vertices
        return rotated(self.rotation(), vertices) + self.shift

    def after(self, first: "Rigid") -> "Rigid":
        """The transform that applies `first`, then this one."""
        return Rigid(product(self.quaternion, first.quaternion), rotated(self.rotation(), first.shift) + self.shift)

    def inverse(self) -> "Rigid":
        """The transform that undoes this one."""
        back = Rigid(self.quaternion * [-1, -1, -1, 1], np.zeros(3))
        return Rigid(back.quaternion, -rotated(back.rotation(), self.shift))

    def between(self, other: "Rigid", t: float) -> "Rigid":
        """The transform at t in [0, 1] between this one and `other`: linear translation, shortest rotation (slerp)."""
        a, b = self.quaternion, other.quaternion
        cosine = dot(a, b)
        if cosine < 0.0:
            b, cosine = -b, -cosine
        angle = math.acos(min(cosine, 1.0))
        if angle < 1e-6:  # the sines vanish; linear is exact to rounding
            mixed = (1 - t) * a + t * b
        else:
            mixed = math.sin((1 - t) * angle) * a + math.sin(t * angle) * b
        return Rigid(mixed / _length(mixed), (1 - t) * self.shift + t * other.shift)

    def rotation(self) -> NDArray[np.float64]:
        """The rotation matrix, (3, 3); read-only."""
        return self._rotation

    @cached_property
    def _rotation(self) -> NDArray[np.float64]:
        x, y, z, w = self.quaternion.tolist()  # Python's numbers: numpy takes three times as long for single ones
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )


IDENTITY = Rigid(np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3))


def product(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """The turn of b, then that of a: a quaternion of length 1."""
    (ax, ay, az, aw), (bx, by, bz, bw) = a.tolist(), b.tolist()
    unscaled = np.array(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ]
    )
    return unscaled / _length(unscaled)


def _length(quaternion: NDArray[np.float64]) -> float:
    return math.sqrt(dot(quaternion, quaternion))


def rotated(rotation: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """points: (3,) or (n,3), each multiplied by the matrix (3,3)."""
    if points.ndim == 1:
        x, y, z = points.tolist()
        return np.array([x * a + y * b + z * c for a, b, c in rotation.tolist()])
    x, y, z = points[..., 0:1], points[..., 1:2], points[..., 2:3]
    turned: NDArray[np.float64] = x * rotation[:, 0] + y * rotation[:, 1] + z * rotation[:, 2]
    return turned
