# SPDX-License-Identifier: Apache-2.0
"""Distances of features in plain floating point: another way to the same truth, good to rounding."""

import numpy as np
from fuzz.generators import EDGE_EDGE, VERTEX_FACE


def _point_segment(p, a, b):
    d = b - a
    length = (d * d).sum(-1)
    s = np.clip(((p - a) * d).sum(-1) / np.where(length > 0, length, 1), 0, 1)
    return np.linalg.norm(p - a - s[..., None] * d, axis=-1)


def _point_triangle(p, a, b, c):
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=-1)
    flat = area < 1e-9
    normal = normal / np.where(flat, 1, area)[..., None]
    height = ((p - a) * normal).sum(-1)
    foot = p - height[..., None] * normal
    sides = [(np.cross(y - x, foot - x) * normal).sum(-1) >= 0 for x, y in ((a, b), (b, c), (c, a))]
    border = np.min([_point_segment(p, a, b), _point_segment(p, b, c), _point_segment(p, c, a)], axis=0)
    return np.where(~flat & np.all(sides, axis=0), np.abs(height), border)


def _segment_segment(a0, a1, b0, b1):
    u, v, w = a1 - a0, b1 - b0, b0 - a0
    normal = np.cross(u, v)
    area = (normal * normal).sum(-1)
    flat = area < 1e-18
    s, t = ((np.cross(w, x) * normal).sum(-1) / np.where(flat, 1, area) for x in (v, u))
    inner = ~flat & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    ends = np.min(
        [
            _point_segment(a0, b0, b1),
            _point_segment(a1, b0, b1),
            _point_segment(b0, a0, a1),
            _point_segment(b1, a0, a1),
        ],
        axis=0,
    )
    return np.where(inner, np.abs((w * normal).sum(-1)) / np.sqrt(np.where(flat, 1, area)), ends)


DISTANCE = {VERTEX_FACE: _point_triangle, EDGE_EDGE: _segment_segment}


def distance_at(kind, queries, t):
    """Euclidean distances (..., Q) of the features of queries (Q,8,3) at times t (..., Q)."""
    points = (1 - t)[..., None, None] * queries[:, :4] + t[..., None, None] * queries[:, 4:]
    return DISTANCE[kind](*np.moveaxis(points, -2, 0))
