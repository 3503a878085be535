# SPDX-License-Identifier: Apache-2.0
"""Elementary queries that aim at degeneracies.

A generator takes (rng, n) and returns (n,8,3) float64 whose coordinates are small integers or random reals: rows are
four points at t=0, then the same four at t=1 (v f0 f1 f2 or a0 a1 b0 b1, depending on the kind). Small integers make
degenerate configurations exact, and `disturbances` can shift and scale them without rounding.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Generator = Callable[[np.random.Generator, int], np.ndarray]

VERTEX_FACE = "vertex-face"
EDGE_EDGE = "edge-edge"


def lattice(rng: np.random.Generator, n: int) -> np.ndarray:
    """Few values for each coordinate: coincident points, flat triangles, coplanar and collinear motion all occur."""
    reach = rng.choice([1, 1, 2, 3, 6], size=(n, 1, 1))
    return rng.integers(-reach, reach + 1, size=(n, 8, 3)).astype(float)


def still(rng: np.random.Generator, n: int) -> np.ndarray:
    """No motion at all, or all points by the same vector."""
    q = lattice(rng, n)
    q[:, 4:] = q[:, :4] + rng.integers(-2, 3, size=(n, 1, 3)) * rng.integers(0, 2, size=(n, 1, 1))
    return q


def in_plane(rng: np.random.Generator, n: int) -> np.ndarray:
    """All points in one plane at all times; the plane may move and its tilt too."""
    q = lattice(rng, n)
    real = rng.random(n) < 0.3
    q[real] = rng.uniform(-2, 2, size=(real.sum(), 8, 3))
    # z = height is exact for real coordinates, z = a x + b y + height for integers, a and b the same at both ends.
    tilt = rng.integers(-2, 3, size=(n, 1, 2)) * ~real[:, None, None]
    height = np.repeat(rng.integers(-2, 3, size=(n, 2)), 4, axis=1)
    q[:, :, 2] = (tilt * q[:, :, :2]).sum(axis=2) + height
    return _shuffle_axes(rng, q)


def on_line(rng: np.random.Generator, n: int) -> np.ndarray:
    """All points on one moving line at all times."""
    direction = np.repeat(rng.integers(-2, 3, size=(n, 2, 3)), 4, axis=1)
    same = rng.random(n) < 0.5
    direction[same, 4:] = direction[same, :4]
    # Where the direction changes, a point keeps its place on the line, which keeps all of them on it in between.
    place = rng.integers(-3, 4, size=(n, 8, 1))
    place[~same, 4:] = place[~same, :4]
    origin = np.repeat(rng.integers(-2, 3, size=(n, 2, 3)), 4, axis=1)
    return (origin + place * direction).astype(float)


def meeting_vertex_face(rng: np.random.Generator, n: int) -> np.ndarray:
    """A vertex that is in the triangle, on its border or just beside it at a rational time, including 0 and 1."""
    corners = 4 * rng.integers(-2, 3, size=(n, 3, 3))
    vertex = barycentric_quarters(rng, corners)
    return _moving_through(rng, np.concatenate([vertex[:, None], corners], axis=1))


def barycentric_quarters(rng: np.random.Generator, corners: np.ndarray) -> np.ndarray:
    """A point of each triangle (n,3,3) of multiples of four, on its border or just beside it."""
    weights = rng.choice(_QUARTERS, size=len(corners))
    return (weights[:, :, None] * corners).sum(axis=1) // 4


def meeting_edge_edge(rng: np.random.Generator, n: int) -> np.ndarray:
    """Edges that cross, touch with an end or pass just beside each other at a rational time, including 0 and 1."""
    ends = 4 * rng.integers(-2, 3, size=(n, 3, 3))
    a0, a1, b0 = ends[:, 0], ends[:, 1], ends[:, 2]
    place = rng.integers(-1, 6, size=(n, 1))
    meeting = (place * a1 + (4 - place) * a0) // 4
    b1 = meeting + rng.integers(-1, 3, size=(n, 1)) * (meeting - b0)
    return _moving_through(rng, np.stack([a0, a1, b0, b1], axis=1))


def parallel_at_root(rng: np.random.Generator, n: int) -> np.ndarray:
    """All four points on one line, or on two parallel lines, at one rational time."""
    direction = rng.integers(-2, 3, size=(n, 1, 3))
    place = rng.integers(-3, 4, size=(n, 4, 1))
    points = place * direction
    points[:, 2:] += rng.integers(-1, 2, size=(n, 1, 3)) * (rng.random((n, 1, 1)) < 0.3)
    return _moving_through(rng, points)


def chosen_roots(rng: np.random.Generator, n: int) -> np.ndarray:
    """Coplanarity polynomials with chosen rational roots, often double or triple."""
    steps = rng.integers(1, 5, size=(n, 1))
    root = rng.integers(-1, 6, size=(n, 3))
    root = np.where(rng.random((n, 3)) < 0.5, root[:, :1], root)
    # Triangular matrix with the linear factors root - steps t on its diagonal: the determinant is their product.
    start, end = (rng.integers(-2, 3, size=(n, 3, 3)) for _ in range(2))
    axis = np.arange(3)
    start[:, axis, axis], end[:, axis, axis] = root, root - steps
    for m in (start, end):
        m[:, [1, 2, 2], [0, 0, 1]] = 0
    for _ in range(3):  # add one coordinate to another: the determinant stays
        a, b = rng.permutation(3)[:2]
        factor = rng.integers(-1, 2, size=(n, 1))
        for m in (start, end):
            m[:, :, a] += factor * m[:, :, b]
    q = np.empty((n, 8, 3))
    for half, m in ((q[:, :4], start), (q[:, 4:], end)):
        base = rng.integers(-2, 3, size=(n, 3))
        # Differences of both kinds: f0-v, f1-v, f2-v are the rows of m; or a0-b0, a1-b0, a0-b1 (up to signs) are.
        half[:, 0], half[:, 1:] = base, base[:, None] + m
    return q


def chosen_roots_edge_edge(rng: np.random.Generator, n: int) -> np.ndarray:
    """As `chosen_roots`, the three vectors being those between the edges' ends."""
    q = chosen_roots(rng, n)
    v, f0, f1, f2 = (q.reshape(n, 2, 4, 3)[:, :, i] for i in range(4))
    return np.stack([f0, f1, v, f0 - (f2 - v)], axis=2).reshape(n, 8, 3)


def thin(rng: np.random.Generator, n: int) -> np.ndarray:
    """Zero-area triangles, zero-length edges, coincident points; still or moving."""
    q = lattice(rng, n)
    for half in (q[:, :4], q[:, 4:]):
        source, target = rng.integers(0, 4, size=(2, n))
        half[np.arange(n), target] = half[np.arange(n), source]
    same = rng.random(n) < 0.5
    source, target = rng.integers(0, 4, size=(2, n))
    for first in (0, 4):
        q[same, first + target[same]] = q[same, first + source[same]]
    return q


def generic(rng: np.random.Generator, n: int) -> np.ndarray:
    """Random reals, no degeneracy intended: large and small motion."""
    start = rng.uniform(-1, 1, size=(n, 4, 3))
    motion = rng.uniform(-1, 1, size=(n, 4, 3)) * 10.0 ** rng.uniform(-3, 1, size=(n, 1, 1))
    return np.concatenate([start, start + motion], axis=1)


def grazing(rng: np.random.Generator, n: int) -> np.ndarray:
    """Random reals that touch at a feature's border at a random time, up to rounding and a tiny offset."""
    corners = rng.uniform(-1, 1, size=(n, 3, 3))
    weights = rng.dirichlet([1, 1, 1], size=n)
    hair = rng.choice([0.0, 1e-17, 1e-16, 1e-15, 1e-12, 1e-8], size=n) * rng.choice([-1, 1], size=n)
    weights[:, 0] = hair
    ends = rng.random(n) < 0.3
    weights[ends, 1] = 0.0
    weights[:, 2] = 1 - weights[:, 0] - weights[:, 1]
    vertex = (weights[:, :, None] * corners).sum(axis=1)
    return _real_motion_through(rng, np.concatenate([vertex[:, None], corners], axis=1))


def grazing_edge_edge(rng: np.random.Generator, n: int) -> np.ndarray:
    """As `grazing`: an end of one edge touches the other edge, or edges are almost parallel when they touch."""
    ends = rng.uniform(-1, 1, size=(n, 4, 3))
    a0, a1, b0, b1 = (ends[:, i] for i in range(4))
    place = rng.choice([0.0, 1.0, 0.5], size=(n, 1)) + rng.choice([0.0, 1e-16, -1e-16, 1e-12, -1e-9], size=(n, 1))
    meeting = a0 + place * (a1 - a0)
    beyond = rng.choice([0.0, 1.0, 1e-16, -1e-16, 1e-12, -1e-9], size=(n, 1))
    b1[:] = meeting + beyond * (meeting - b0)
    nearly_parallel = rng.random(n) < 0.3
    b0[nearly_parallel] = (meeting + (a1 - a0) * rng.uniform(-1, 1, size=(n, 1)))[nearly_parallel]
    b0[nearly_parallel] += 10.0 ** rng.uniform(-18, -6, size=(nearly_parallel.sum(), 1))
    return _real_motion_through(rng, ends)


def near_multiple_root(rng: np.random.Generator, n: int) -> np.ndarray:
    """Coplanarity polynomials with double and triple roots that a tiny change splits or makes complex."""
    q = chosen_roots(rng, n)
    q += rng.choice([0.0, 1e-16, 1e-13, 1e-9, 1e-5], size=(n, 1, 1)) * rng.uniform(-1, 1, size=(n, 8, 3))
    return q


BOTH: dict[str, Generator] = {
    g.__name__: g for g in (lattice, still, in_plane, on_line, parallel_at_root, thin, generic, near_multiple_root)
}
GENERATORS: dict[str, dict[str, Generator]] = {
    VERTEX_FACE: BOTH | {"meeting": meeting_vertex_face, "chosen_roots": chosen_roots, "grazing": grazing},
    EDGE_EDGE: BOTH
    | {"meeting": meeting_edge_edge, "chosen_roots": chosen_roots_edge_edge, "grazing": grazing_edge_edge},
}

# Barycentric coordinates in quarters: corners, points of edges, inside, and one quarter outside.
_QUARTERS = np.array([(a, b, 4 - a - b) for a in range(-1, 6) for b in range(-1, 6) if -1 <= 4 - a - b <= 5])


def _shuffle_axes(rng: np.random.Generator, q: np.ndarray) -> np.ndarray:
    order = rng.permuted(np.tile(np.arange(3), (len(q), 1)), axis=1)
    return np.take_along_axis(q, order[:, None, :], axis=2)


def _moving_through(rng: np.random.Generator, meeting: np.ndarray) -> np.ndarray:
    """Integer motion that passes through the configuration (n,4,3) at t = i/(i+j), exactly; i or j may be 0."""
    n = len(meeting)
    before, after = rng.integers(0, 4, size=(2, n, 1, 1))
    motion = rng.integers(-2, 3, size=(n, 4, 3))
    motion *= rng.random((n, 4, 1)) < 0.8
    return np.concatenate([meeting - before * motion, meeting + after * motion], axis=1).astype(float)


def _real_motion_through(rng: np.random.Generator, meeting: np.ndarray) -> np.ndarray:
    n = len(meeting)
    time = rng.choice([0.0, 1.0, 0.5, 1 / 3], size=(n, 1, 1))
    anywhere = rng.random((n, 1, 1))
    time = np.where(rng.random((n, 1, 1)) < 0.5, anywhere, time)
    motion = rng.uniform(-1, 1, size=(n, 4, 3)) * 10.0 ** rng.uniform(-3, 0.5, size=(n, 1, 1))
    return np.concatenate([meeting - time * motion, meeting + (1 - time) * motion], axis=1)
