# SPDX-License-Identifier: Apache-2.0
"""Elementary queries at a distance: a generator takes (rng, n) and returns (n,8,3) queries and (n,) distances.

Exact distances come from configurations along the axes, rotated by integer frames: orthogonal rows of equal integer
length (Pythagorean quadruples).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import oracle

from .generators import EDGE_EDGE, GENERATORS, VERTEX_FACE

NearQueries = tuple[np.ndarray, np.ndarray]
NearGenerator = Callable[[np.random.Generator, int], NearQueries]

DISTANCE = {VERTEX_FACE: oracle.distance_vertex_face, EDGE_EDGE: oracle.distance_edge_edge}

FRAMES = np.array(
    [
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[1, 2, 2], [2, 1, -2], [2, -2, 1]],
        [[2, 3, 6], [3, -6, 2], [6, 2, -3]],
        [[1, 4, 8], [4, 7, -4], [8, -4, 1]],
        [[3, 4, 0], [4, -3, 0], [0, 0, 5]],
    ]
)


def in_a_frame(rng: np.random.Generator, local: np.ndarray, height: np.ndarray) -> NearQueries:
    """Turn each query (n,8,3) by a frame: lengths, the height (n,) among them, are multiplied by the frame's."""
    frame = FRAMES[rng.integers(len(FRAMES), size=len(local))]
    length = np.sqrt((frame[:, 0] ** 2).sum(axis=1))
    turned = np.einsum("nij,njk->nik", local, frame)
    axes = rng.permuted(np.tile(np.arange(3), (len(local), 1)), axis=1)
    turned = np.take_along_axis(turned, axes[:, None, :], axis=2) * rng.choice([-1, 1], size=(len(local), 1, 3))
    # A common motion of all points changes no distance.
    start, end = rng.integers(-3, 4, size=(2, len(local), 1, 3))
    turned[:, :4] += start
    turned[:, 4:] += end
    return turned.astype(float), height * length


def over_a_face(rng: np.random.Generator, n: int) -> NearQueries:
    """A vertex that moves parallel to a triangle's plane at the distance, arrives at it, or starts there."""
    local = rng.integers(-4, 5, size=(n, 8, 3))
    local[:, [0, 4], :2] *= rng.integers(1, 4, size=(n, 1, 1))
    still = rng.random(n) < 0.5
    local[still, 5:] = local[still, 1:4]
    local[:, :, 2] = 0
    height = rng.integers(1, 5, size=n)
    before, after = _arrival(rng, n)
    local[:, 0, 2], local[:, 4, 2] = height + before, height - after
    return in_a_frame(rng, local, height)


def over_a_border(rng: np.random.Generator, n: int) -> NearQueries:
    """A vertex that passes over a triangle's edge or corner and reaches the distance once."""
    local = np.zeros((n, 8, 3), dtype=int)
    local[:, 1:4, 0] = rng.integers(-3, 4, size=(n, 3))
    local[:, 3, 2] = -rng.integers(0, 4, size=n)
    local[:, 5:] = local[:, 1:4]
    height = rng.integers(1, 5, size=n)
    _pass_over(rng, local[:, 0], local[:, 4], height)
    return in_a_frame(rng, local, height)


def crossing_planes(rng: np.random.Generator, n: int) -> NearQueries:
    """Edges in two planes at the distance, or that reach it: moving within the planes, parallel, collinear."""
    local = rng.integers(-4, 5, size=(n, 8, 3))
    still = rng.random(n) < 0.5
    local[still, 4:6] = local[still, :2]
    parallel = rng.random(n) < 0.4
    for first in (0, 4):
        along = rng.integers(-2, 3, size=(n, 1)) * (local[:, first + 1] - local[:, first])
        local[parallel, first + 3] = (local[:, first + 2] + along)[parallel]
    local[:, :, 2] = 0
    height = rng.integers(1, 5, size=n)
    before, after = _arrival(rng, n)
    local[:, 2:4, 2], local[:, 6:, 2] = (height + before)[:, None], (height - after)[:, None]
    return in_a_frame(rng, local, height)


def end_over_an_edge(rng: np.random.Generator, n: int) -> NearQueries:
    """An edge whose end passes over the other edge and reaches the distance once."""
    local = np.zeros((n, 8, 3), dtype=int)
    local[:, :2, 0] = rng.integers(-3, 4, size=(n, 2))
    local[:, 4:6] = local[:, :2]
    height = rng.integers(1, 5, size=n)
    _pass_over(rng, local[:, 2], local[:, 6], height)
    rest = rng.integers(-3, 4, size=(n, 3))
    rest[:, 2] = rng.integers(0, 4, size=n)
    local[:, 3], local[:, 7] = local[:, 2] + rest, local[:, 6] + rest
    return in_a_frame(rng, local, height)


def small_numbers(kind: str, name: str) -> NearGenerator:
    """Queries of a generator of contacts, with distances that lattice points have."""

    def near(rng: np.random.Generator, n: int) -> NearQueries:
        queries = GENERATORS[kind][name](rng, n)
        return queries, rng.choice([0.25, 0.5, 1.0, 1.0, 2.0, 3.0, 5.0], size=n)

    return near


def at_some_time(kind: str, name: str) -> NearGenerator:
    """Queries of a generator of contacts, with the distance that they have at some time, or a neighbouring double."""

    def near(rng: np.random.Generator, n: int) -> NearQueries:
        queries = GENERATORS[kind][name](rng, n)
        time = rng.integers(0, 5, size=(n, 1, 1)) / 4
        distance = DISTANCE[kind](queries[:, :4] + time * (queries[:, 4:] - queries[:, :4]))
        neighbour = np.nextafter(distance, rng.choice([-np.inf, np.inf], size=n))
        distance = np.where(rng.random(n) < 0.4, neighbour, distance)
        return queries, np.where(distance > 0, distance, 10.0 ** rng.uniform(-16, 0, size=n))

    return near


def _arrival(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """How far before and behind the height: nothing for gliding, else it is reached at before / (before + after)."""
    glides = rng.random(n) < 0.4
    before, after = rng.integers(0, 4, size=(2, n))
    return np.where(glides, 0, before), np.where(glides, 0, after)


def _pass_over(rng: np.random.Generator, start: np.ndarray, end: np.ndarray, height: np.ndarray) -> None:
    """Write a motion across the x axis at the height: over it at time 0, 1 or between."""
    n = len(start)
    before, after = rng.integers(0, 5, size=(2, n))
    start[:, 0], end[:, 0] = rng.integers(-3, 4, size=(2, n))
    straight = rng.random(n) < 0.6
    end[straight, 0] = start[straight, 0]
    start[:, 1], end[:, 1] = -before, after
    start[:, 2] = end[:, 2] = height


def _all(kind: str, exact: dict[str, NearGenerator]) -> dict[str, NearGenerator]:
    generators = dict(exact)
    for name in GENERATORS[kind]:
        generators[f"{name}, small numbers"] = small_numbers(kind, name)
        generators[f"{name}, at some time"] = at_some_time(kind, name)
    return generators


NEAR_GENERATORS: dict[str, dict[str, NearGenerator]] = {
    VERTEX_FACE: _all(VERTEX_FACE, {"over_a_face": over_a_face, "over_a_border": over_a_border}),
    EDGE_EDGE: _all(EDGE_EDGE, {"crossing_planes": crossing_planes, "end_over_an_edge": end_over_an_edge}),
}
