# SPDX-License-Identifier: Apache-2.0
"""Mutations for the search for slow queries: small and large ones, most of them towards unusual magnitudes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .near_generators import DISTANCE

LOWEST, HIGHEST = -1074, 497  # binary exponents: from the smallest number to 1e150, the largest coordinate accepted

Query = tuple[np.ndarray, float]  # points (8,3), of a snapshot (4,3) or (5,3); distance, 0 where none is asked for


def within_range(query: Query, span: int) -> Query:
    """Coordinates no larger than accepted, and exponents no further apart than span: small numbers are raised."""
    points, distance = np.clip(query[0], -(2.0**HIGHEST), 2.0**HIGHEST), query[1]
    numbers = np.append(points.ravel(), distance)
    mantissas, exponents = np.frexp(numbers)
    exponents = np.where(numbers == 0, exponents, np.maximum(exponents, exponents[numbers != 0].max(initial=0) - span))
    numbers = np.ldexp(mantissas, exponents)
    return numbers[:-1].reshape(points.shape), float(numbers[-1])


def mutated(rng: np.random.Generator, kind: str, query: Query, other: Query) -> Query:
    """One to four changes, each of a random kind; a distance changes in one case of three."""
    points, distance = query[0].copy(), query[1]
    for _ in range(rng.integers(1, 5)):
        CHANGES[rng.integers(len(CHANGES))](rng, points, other[0])
    if distance > 0 and rng.random() < 1 / 3:
        distance = other_distance(rng, kind, points, distance, other[1])
    return points, distance


def other_distance(rng: np.random.Generator, kind: str, points: np.ndarray, distance: float, other: float) -> float:
    """A neighbour, another exponent, that of another query, or one that these points have at some time."""
    way = rng.integers(5)
    if way == 0:
        distance = np.nextafter(distance, rng.choice([0.0, np.inf]))
    elif way == 1:
        distance = np.ldexp(distance, rng.integers(-3, 4))
    elif way == 2:
        distance = np.ldexp(np.frexp(distance)[0], rng.integers(LOWEST, HIGHEST))
    elif way == 3:
        distance = other
    else:
        time = rng.choice([0.0, 0.25, 0.5, 1.0])
        with np.errstate(over="ignore"):
            now = (1 - time) * points[:4] + time * points[4:] if len(points) == 8 else points
        distance = DISTANCE[kind](now[None])[0]
    return float(np.clip(distance, 2.0**LOWEST, 2.0**HIGHEST))


def new_exponent(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    point, axis = _place(rng, query)
    query[point, axis] = np.ldexp(np.frexp(query[point, axis])[0] or 1.0, rng.integers(LOWEST, HIGHEST))


def next_exponent(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    place = _place(rng, query)
    query[place] = np.ldexp(query[place], rng.integers(-3, 4))


def new_value(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    query[_place(rng, query)] = np.ldexp(
        rng.choice([-1.0, 0.0, 1.0, rng.uniform(-1, 1)]), rng.integers(LOWEST, HIGHEST)
    )


def other_mantissa(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    place = _place(rng, query)
    bits = query[place].view(np.uint64) ^ np.uint64(1 << int(rng.integers(52)))
    query[place] = bits.view(np.float64)


def negative(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    query[_place(rng, query)] *= -1


def one_ulp(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    place = _place(rng, query)
    query[place] = np.nextafter(query[place], rng.choice([-np.inf, np.inf]))


def same_number(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    query[_place(rng, query)] = rng.choice([-1.0, 1.0]) * query[_place(rng, query)]


def same_point(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    query[rng.integers(len(query))] = query[rng.integers(len(query))]


def scaled_axis(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    query[rng.integers(len(query)), :] *= np.ldexp(1.0, rng.integers(-60, 61, size=3))


def flat(rng: np.random.Generator, query: np.ndarray, _: np.ndarray) -> None:
    """Coplanar throughout."""
    query[:, rng.integers(3)] = 0


def crossed(rng: np.random.Generator, query: np.ndarray, other: np.ndarray) -> None:
    mask = rng.random((len(query), 3)) < 0.3 if rng.random() < 0.5 else rng.random((len(query), 1)) < 0.3
    query[:] = np.where(mask, other, query)


Change = Callable[[np.random.Generator, np.ndarray, np.ndarray], None]
CHANGES: tuple[Change, ...] = (
    new_exponent,
    next_exponent,
    new_value,
    other_mantissa,
    negative,
    one_ulp,
    same_number,
    same_point,
    scaled_axis,
    flat,
    crossed,
)


def _place(rng: np.random.Generator, query: np.ndarray) -> tuple[int, int]:
    return int(rng.integers(len(query))), int(rng.integers(3))
