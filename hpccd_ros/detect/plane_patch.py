# SPDX-License-Identifier: Apache-2.0
"""The part of a plane near a scene, to be drawn. No ROS."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hpccd_ros.detect.scene import PlaneSettings

#: Two triangles of a patch's corners, and the edges around them.
FACES = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
OUTLINE = np.array([[0, 1], [1, 2], [2, 3], [0, 3]], np.uint32)


def patch(plane: PlaneSettings, vertices: Sequence[np.ndarray], margin=0.25) -> NDArray[np.float64] | None:
    """(4, 3): a rectangle of the plane beneath the meshes, counterclockwise seen from its half-space; None: the plane
    is farther from all vertices than their extent, or there are none. margin: on each side, a part of this extent."""
    known = [np.asarray(v, np.float64) for v in vertices if len(v)]
    if not known:
        return None
    low, high = np.min([v.min(axis=0) for v in known], axis=0), np.max([v.max(axis=0) for v in known], axis=0)
    centre, extent = 0.5 * low + 0.5 * high, float(np.linalg.norm(high - low))
    normal = np.asarray(plane.normal, np.float64)
    scale = np.abs(normal).max()
    length = scale * np.linalg.norm(normal / scale)
    normal, offset = normal / length, plane.offset / length
    above = float(normal @ centre) - offset
    if not abs(above) <= extent:  # not a number, too
        return None
    u = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    axes = np.stack([u, v])
    half = np.maximum(np.abs(axes) @ (0.5 * high - 0.5 * low), 0.25 * extent) + margin * extent
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    return centre - above * normal + corners @ (half[:, None] * axes)
