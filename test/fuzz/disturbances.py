# SPDX-License-Identifier: Apache-2.0
"""Random changes of degenerate queries: permutation, shift, scale, rounding, one ulp."""

from __future__ import annotations

import numpy as np

from .generators import VERTEX_FACE


def disturb(rng: np.random.Generator, q: np.ndarray, kind: str) -> np.ndarray:
    """Apply random functions of those below, chosen for each query. q: (n,8,3) float64; returns the same shape."""
    q = permute(rng, q, kind)
    for change, share in ((uneven, 0.1), (rotate, 0.1), (offset, 0.3), (scale, 0.4), (single, 0.15), (one_ulp, 0.3)):
        chosen = rng.random(len(q)) < share
        q[chosen] = change(rng, q[chosen])
    return q


def disturb_near(
    rng: np.random.Generator, q: np.ndarray, distance: np.ndarray, kind: str
) -> tuple[np.ndarray, np.ndarray]:
    """The same for queries with distances (n,), which are scaled with them."""
    q, distance = permute(rng, q, kind), distance.copy()
    for change, share in ((uneven, 0.1), (rotate, 0.1), (offset, 0.2)):
        chosen = rng.random(len(q)) < share
        q[chosen] = change(rng, q[chosen])
    chosen = rng.random(len(q)) < 0.4
    factor = factors(rng, chosen.sum())
    q[chosen] *= factor[:, None, None]
    distance[chosen] *= factor
    for change, share in ((single, 0.15), (one_ulp, 0.2)):
        chosen = rng.random(len(q)) < share
        q[chosen] = change(rng, q[chosen])
    neighbour = rng.random(len(q)) < 0.1
    distance[neighbour] = np.nextafter(distance[neighbour], rng.choice([-np.inf, np.inf], size=neighbour.sum()))
    return q, np.maximum(distance, np.nextafter(0.0, 1.0))


def disturb_still(rng: np.random.Generator, points: np.ndarray) -> np.ndarray:
    """The same for points at rest (n,p,3), the order of which stays."""
    points = points.copy()
    for change, share in ((rotate, 0.1), (offset, 0.3), (scale, 0.4), (single, 0.15), (one_ulp, 0.3)):
        chosen = rng.random(len(points)) < share
        points[chosen] = change(rng, points[chosen])
    return points


def permute(rng: np.random.Generator, q: np.ndarray, kind: str) -> np.ndarray:
    """Permute the triangle's corners, or the edges and their ends; the result stays the same."""
    n = len(q)
    if kind == VERTEX_FACE:
        corners = rng.permuted(np.tile([1, 2, 3], (n, 1)), axis=1)
        order = np.concatenate([np.zeros((n, 1), dtype=int), corners], axis=1)
    else:
        first, second = rng.permuted(np.tile([0, 1], (n, 1)), axis=1), rng.permuted(np.tile([2, 3], (n, 1)), axis=1)
        swap = rng.random((n, 1)) < 0.5
        order = np.where(swap, np.hstack([second, first]), np.hstack([first, second]))
    return np.take_along_axis(q, np.hstack([order, order + 4])[:, :, None], axis=1)


def uneven(rng: np.random.Generator, q: np.ndarray) -> np.ndarray:
    """Shrink coordinates of two of the four points, or motion relative to size, by a power of two."""
    q = q.copy()
    factor = 2.0 ** -rng.integers(1, 45, size=(len(q), 1, 1))
    points = rng.random(len(q)) < 0.5
    q[np.ix_(points, [2, 3, 6, 7])] *= factor[points]
    q[~points, 4:] = q[~points, :4] + factor[~points] * (q[~points, 4:] - q[~points, :4])
    return q


def rotate(rng: np.random.Generator, q: np.ndarray) -> np.ndarray:
    """A random rotation: exact degeneracies become ones up to rounding."""
    m = rng.normal(size=(len(q), 3, 3))
    return q @ np.linalg.qr(m)[0]


def offset(rng: np.random.Generator, q: np.ndarray) -> np.ndarray:
    """Shift all points far away: by a power of two (exact for small integers) or any value, up to 1e12 times."""
    exact = 2.0 ** rng.integers(0, 40, size=(len(q), 1, 3)) * rng.integers(-1, 2, size=(len(q), 1, 3))
    rounded = 10.0 ** rng.uniform(-3, 12, size=(len(q), 1, 1)) * rng.uniform(-1, 1, size=(len(q), 1, 3))
    return q + np.where(rng.random((len(q), 1, 1)) < 0.5, exact, rounded)


def scale(rng: np.random.Generator, q: np.ndarray) -> np.ndarray:
    """Scales of `factors`, each query its own."""
    return q * factors(rng, len(q))[:, None, None]


def factors(rng: np.random.Generator, n: int) -> np.ndarray:
    """1e-30 to 1e30, a power of two (exact) or of ten (rounded); a few lead down to denormal numbers."""
    exponent = rng.uniform(-30, 30, size=n)
    exact = np.exp2(np.round(exponent * np.log2(10)))
    factor = np.where(rng.random(n) < 0.6, exact, 10.0**exponent)
    return np.where(rng.random(n) < 0.05, np.exp2(-1070.0), factor)


def single(rng: np.random.Generator, q: np.ndarray) -> np.ndarray:
    """Values that float32 holds."""
    with np.errstate(over="ignore", under="ignore"):
        rounded = q.astype(np.float32).astype(np.float64)
    return np.where(np.isfinite(rounded), rounded, q)


def one_ulp(rng: np.random.Generator, q: np.ndarray) -> np.ndarray:
    """Move one to three coordinates to a neighbouring double."""
    q = q.copy()
    rows = np.arange(len(q))
    for _ in range(3):
        point, axis = rng.integers(0, q.shape[1], size=len(q)), rng.integers(0, 3, size=len(q))
        towards = np.where(rng.random(len(q)) < 0.5, -np.inf, np.inf)
        moved = np.nextafter(q[rows, point, axis], towards)
        # Stepping away from 0 gives the smallest denormal number; now and then is enough, in each case it is exact.
        leave = (q[rows, point, axis] == 0) & (rng.random(len(q)) < 0.8) | (rng.random(len(q)) < 0.3)
        q[rows, point, axis] = np.where(leave, q[rows, point, axis], moved)
    return q
