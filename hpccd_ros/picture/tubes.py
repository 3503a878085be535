# SPDX-License-Identifier: Apache-2.0
"""Edges in no face, as thin tubes: a line has no surface to shade."""

import numpy as np

SIDES = 5
RADIUS = 0.0035  # of the scene's extent


def tubes(vertices: np.ndarray, edges: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions (N,3), faces (F,3) of these, and for each of them the vertex (N,) whose colour it has.

    vertices: (V,3). edges: (E,2), indices of them. One without length has no tube.
    """
    length = np.linalg.norm(vertices[edges[:, 1]] - vertices[edges[:, 0]], axis=1)
    edges, length = edges[length > 0], length[length > 0]
    ends = vertices[edges]
    along = (ends[:, 1] - ends[:, 0]) / length[:, None]
    # Across the axis along which the edge goes least, so that the cross product does not vanish.
    least = np.eye(3)[np.abs(along).argmin(axis=1)]
    first = np.cross(along, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(along, first)
    angle = np.arange(SIDES) * 2 * np.pi / SIDES
    ring = np.cos(angle)[:, None] * first[:, None] + np.sin(angle)[:, None] * second[:, None]  # (E, SIDES, 3)
    positions = ends[:, :, None] + radius * ring[:, None]  # (E, 2, SIDES, 3)
    low = np.arange(SIDES)
    high, next_low = low + SIDES, (low + 1) % SIDES
    quads = np.concatenate([np.stack([low, next_low, high], 1), np.stack([high, next_low, next_low + SIDES], 1)])
    faces = quads + 2 * SIDES * np.arange(len(edges))[:, None, None]
    return positions.reshape(-1, 3), faces.reshape(-1, 3), np.repeat(edges.reshape(-1), SIDES)
