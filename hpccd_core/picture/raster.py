# SPDX-License-Identifier: Apache-2.0
"""Which triangle is seen in each pixel: a z-buffer in numpy, whole batches of triangles at a time."""

import dataclasses

import numpy as np

# Pixels tested at once: bounds the temporary arrays to about 150 MB.
BATCH = 1_000_000


@dataclasses.dataclass
class Buffers:
    """Per pixel, (height, width): depth (inf: nothing), triangle (-1: nothing), weights (..., 2) of corners 1, 2."""

    depth: np.ndarray
    triangle: np.ndarray
    weights: np.ndarray


def rasterize(corners, size, perspective=True) -> Buffers:
    """Nearest triangle of each pixel.

    corners: (F,3,3) projected corners: x and y in pixels (y down), positive depth. size: (width, height).
    perspective: corner weights are corrected for a perspective view, so that they interpolate in space.
    """
    width, height = size
    buffers = Buffers(
        np.full(width * height, np.inf, dtype=np.float32),
        np.full(width * height, -1, dtype=np.int32),
        np.zeros((width * height, 2), dtype=np.float32),
    )
    low = np.clip(np.floor(corners[:, :, :2].min(axis=1) - 0.5), 0, None).astype(np.int64)
    high = np.ceil(corners[:, :, :2].max(axis=1) + 0.5).astype(np.int64)
    high = np.minimum(high, np.array([width, height]))
    span = np.maximum(high - low, 0)
    pixels = span[:, 0] * span[:, 1]
    pixels[(corners[:, :, 2] <= 0).any(axis=1)] = 0  # behind the eye
    order = np.flatnonzero(pixels)
    ends = np.cumsum(pixels[order])
    start = 0
    while start < len(order):
        done = ends[start - 1] if start else 0
        stop = max(start + 1, int(np.searchsorted(ends, done + BATCH)))
        _draw(buffers, corners, order[start:stop], low, span, width, perspective)
        start = stop
    return Buffers(
        buffers.depth.reshape(height, width),
        buffers.triangle.reshape(height, width),
        buffers.weights.reshape(height, width, 2),
    )


def _draw(buffers, corners, triangles, low, span, width, perspective):
    counts = span[triangles, 0] * span[triangles, 1]
    owner = np.repeat(np.arange(len(triangles)), counts)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    columns = span[triangles, 0][owner]
    x = low[triangles, 0][owner] + within % columns
    y = low[triangles, 1][owner] + within // columns
    p = corners[triangles]
    a, b, c = p[:, 0], p[:, 1], p[:, 2]
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = (1.0 / area)[owner]
        dx, dy = x + 0.5 - a[owner, 0], y + 0.5 - a[owner, 1]
        u = (dx * (c[:, 1] - a[:, 1])[owner] - dy * (c[:, 0] - a[:, 0])[owner]) * inverse
        v = (dy * (b[:, 0] - a[:, 0])[owner] - dx * (b[:, 1] - a[:, 1])[owner]) * inverse
        inside = (u >= 0) & (v >= 0) & (u + v <= 1)  # false for NaN: degenerate triangles are not seen
    owner, x, y, u, v = owner[inside], x[inside], y[inside], u[inside], v[inside]
    z = 1.0 / p[:, :, 2] if perspective else p[:, :, 2]  # 1/depth is what is linear on the screen
    mixed = z[owner, 0] * (1 - u - v) + z[owner, 1] * u + z[owner, 2] * v
    depth = (1.0 / mixed if perspective else mixed).astype(np.float32)
    if perspective:
        u, v = u * z[owner, 1] / mixed, v * z[owner, 2] / mixed
    pixel = y * width + x
    nearer = depth < buffers.depth[pixel]
    pixel, depth, owner, u, v = pixel[nearer], depth[nearer], owner[nearer], u[nearer], v[nearer]
    far_first = np.argsort(-depth, kind="stable")  # of equal indices, the last assignment stands
    pixel = pixel[far_first]
    buffers.depth[pixel] = depth[far_first]
    buffers.triangle[pixel] = triangles[owner[far_first]]
    buffers.weights[pixel, 0] = u[far_first]
    buffers.weights[pixel, 1] = v[far_first]
