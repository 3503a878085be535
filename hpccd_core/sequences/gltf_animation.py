# SPDX-License-Identifier: Apache-2.0
"""Animated values of glTF: key frames, and the transforms of nodes."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Channel:
    """Key frames of one value.

    Parameters
    ----------
    times : (K,) float64
        In seconds, increasing.
    values : (K, n) float64, or (K, 3, n) with the tangents of a cubic spline
        The value at each time.
    interpolation : str
        LINEAR, STEP or CUBICSPLINE.
    rotation : bool
        Whether the values are quaternions.
    """

    times: NDArray[np.float64]
    values: NDArray[np.float64]
    interpolation: str
    rotation: bool

    def at(self, time: float) -> NDArray[np.float64]:
        """(n,) float64: the value at a time; exactly that of a key frame at its time."""
        cubic = self.interpolation == "CUBICSPLINE"
        values = self.values[:, 1] if cubic else self.values
        k = int(np.searchsorted(self.times, time, side="right")) - 1
        if k < 0 or k == len(self.times) - 1 or self.times[k] == time or self.interpolation == "STEP":
            return np.asarray(values[max(k, 0)])
        length = float(self.times[k + 1] - self.times[k])
        u = (time - float(self.times[k])) / length
        a, b = values[k], values[k + 1]
        if cubic:
            out, into = self.values[k, 2] * length, self.values[k + 1, 0] * length
            found = (2 * u**3 - 3 * u**2 + 1) * a + (u**3 - 2 * u**2 + u) * out
            found = found + (3 * u**2 - 2 * u**3) * b + (u**3 - u**2) * into
        elif self.rotation:
            found = _slerp(a, b, u)
        else:
            found = (1 - u) * a + u * b
        return np.asarray(found)


def _slerp(a: NDArray[np.float64], b: NDArray[np.float64], u: float) -> NDArray[np.float64]:
    cosine = float(a @ b)
    if cosine < 0:
        b, cosine = -b, -cosine
    angle = np.arccos(min(cosine, 1.0))
    if angle < 1e-6:
        return (1 - u) * a + u * b
    return np.asarray((np.sin((1 - u) * angle) * a + np.sin(u * angle) * b) / np.sin(angle))


def local_matrix(node: dict[str, Any], animated: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """(4, 4): the transform of a node to its parent. animated: values that replace those of the node."""
    if "matrix" in node and not animated:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    x, y, z, w = animated.get("rotation", np.array(node.get("rotation", (0, 0, 0, 1)), np.float64))
    n = x * x + y * y + z * z + w * w
    s = 2 / n if n > 0 else 0.0
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
        [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
        [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
    ]
    matrix[:3, :3] *= animated.get("scale", np.array(node.get("scale", (1, 1, 1)), np.float64))
    matrix[:3, 3] = animated.get("translation", np.array(node.get("translation", (0, 0, 0)), np.float64))
    return matrix
