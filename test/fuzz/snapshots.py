# SPDX-License-Identifier: Apache-2.0
"""Degenerate points at rest: (n,4,3) with distances for proximity, (n,5,3) for edges and faces."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .disturbances import disturb_near, disturb_still
from .generators import GENERATORS, VERTEX_FACE, barycentric_quarters
from .near_generators import DISTANCE, NEAR_GENERATORS, NearQueries

EDGE_FACE = "edge-face"


def near_snapshot(kind: str, name: str) -> Callable[[np.random.Generator, int], NearQueries]:
    """The start or the end of disturbed queries; of many the distance that they have, or a neighbouring double."""

    def near(rng: np.random.Generator, n: int) -> NearQueries:
        queries, distance = disturb_near(rng, *NEAR_GENERATORS[kind][name](rng, n), kind)
        points = np.where(rng.random((n, 1, 1)) < 0.5, queries[:, :4], queries[:, 4:])
        exactly = rng.random(n) < 0.5
        distance[exactly] = DISTANCE[kind](points[exactly])
        beside = exactly & (rng.random(n) < 0.5)
        distance[beside] = np.nextafter(distance[beside], rng.choice([-np.inf, np.inf], size=beside.sum()))
        return points, np.maximum(distance, 0.0)

    return near


def path_of_a_vertex(name: str) -> Callable[[np.random.Generator, int], np.ndarray]:
    """The edge along which the vertex of a query moves, and the face as it is at its start."""

    def points(rng: np.random.Generator, n: int) -> np.ndarray:
        queries = GENERATORS[VERTEX_FACE][name](rng, n)
        return disturb_still(rng, np.concatenate([queries[:, [0, 4]], queries[:, 1:4]], axis=1))

    return points


def through_a_point(rng: np.random.Generator, n: int) -> np.ndarray:
    """An edge that ends at a point of the face or just beside it, or runs through it; in its plane at times."""
    corners = 4 * rng.integers(-2, 3, size=(n, 3, 3))
    meeting = barycentric_quarters(rng, corners)
    direction = rng.integers(-2, 3, size=(n, 3))
    in_plane = rng.random(n) < 0.3
    sides = corners[:, 1:] - corners[:, :1]
    direction[in_plane] = (sides[:, 0] + rng.integers(-1, 2, size=(n, 1)) * sides[:, 1])[in_plane]
    before, after = rng.integers(-1, 3, size=(2, n, 1))
    ends = np.stack([meeting - before * direction, meeting + after * direction], axis=1)
    return disturb_still(rng, np.concatenate([ends, corners], axis=1).astype(float))


def needles_on_a_line(rng: np.random.Generator, n: int) -> np.ndarray:
    """Five points of one line, rounded to single precision: a needle whose plane is ill-conditioned."""
    start, along = rng.standard_normal((2, n, 1, 3))
    return (start + rng.uniform(-1, 1, size=(n, 5, 1)) * along).astype(np.float32).astype(float)


SNAPSHOTS = {kind: {name: near_snapshot(kind, name) for name in names} for kind, names in NEAR_GENERATORS.items()}
EDGE_FACE_POINTS = {name: path_of_a_vertex(name) for name in GENERATORS[VERTEX_FACE]}
EDGE_FACE_POINTS[through_a_point.__name__] = through_a_point
EDGE_FACE_POINTS[needles_on_a_line.__name__] = needles_on_a_line
