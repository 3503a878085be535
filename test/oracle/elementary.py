# SPDX-License-Identifier: Apache-2.0
"""Exact elementary tests of many pairs at once. All raise ValueError on a wrong shape, NaN or Inf; threads: 0 = all."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import _oracle
import numpy as np
from numpy.typing import ArrayLike


def vertex_face(queries: np.ndarray, threads: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Exact contact of a moving vertex and a moving closed triangle.

    queries: (Q,8,3) finite float32 or float64; rows v f0 f1 f2 at t=0, then the same at t=1.
    Returns hit (Q,) bool and toc (Q,) float64: the earliest time of contact rounded down to a double, +inf where there
    is none.
    """
    return _hit_and_toc(_oracle.vertex_face(_checked("queries", queries, 8), threads))


def edge_edge(queries: np.ndarray, threads: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Exact contact of two moving closed segments.

    queries: (Q,8,3) finite float32 or float64; rows a0 a1 b0 b1 at t=0, then the same at t=1. Results as in
    `vertex_face`.
    """
    return _hit_and_toc(_oracle.edge_edge(_checked("queries", queries, 8), threads))


def separation_vertex_face(queries: np.ndarray, distance: ArrayLike, threads: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Whether and when a moving vertex and a moving closed triangle first are within a distance (scalar or (Q,)).

    Queries and results as in `vertex_face`; 0 is contact.
    """
    checked = _checked("queries", queries, 8)
    return _hit_and_toc(_oracle.separation_vertex_face(checked, _distances(distance, len(checked)), threads))


def separation_edge_edge(queries: np.ndarray, distance: ArrayLike, threads: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """The same for two moving closed segments."""
    checked = _checked("queries", queries, 8)
    return _hit_and_toc(_oracle.separation_edge_edge(checked, _distances(distance, len(checked)), threads))


def distance_vertex_face(points: np.ndarray, threads: int = 0) -> np.ndarray:
    """Distances (Q,) of points (Q,4,3), rows v f0 f1 f2, rounded to the nearest double."""
    return _oracle.distance_vertex_face(_checked("points", points, 4), threads)


def distance_edge_edge(points: np.ndarray, threads: int = 0) -> np.ndarray:
    """Distances (Q,) of points (Q,4,3), rows a0 a1 b0 b1, rounded to the nearest double."""
    return _oracle.distance_edge_edge(_checked("points", points, 4), threads)


def squared_distance_vertex_face(points: np.ndarray) -> list[Fraction]:
    """The exact squared distances of points (Q,4,3), rows v f0 f1 f2."""
    return _squared(_oracle.squared_distance_vertex_face, points)


def squared_distance_edge_edge(points: np.ndarray) -> list[Fraction]:
    """The same for points (Q,4,3), rows a0 a1 b0 b1."""
    return _squared(_oracle.squared_distance_edge_edge, points)


def within_vertex_face(points: np.ndarray, distance: ArrayLike, threads: int = 0) -> np.ndarray:
    """Whether (Q,) points (Q,4,3), rows v f0 f1 f2, are at most the distance apart (scalar or (Q,))."""
    checked = _checked("points", points, 4)
    return _oracle.within_vertex_face(checked, _distances(distance, len(checked)), threads)


def within_edge_edge(points: np.ndarray, distance: ArrayLike, threads: int = 0) -> np.ndarray:
    """The same for points (Q,4,3), rows a0 a1 b0 b1."""
    checked = _checked("points", points, 4)
    return _oracle.within_edge_edge(checked, _distances(distance, len(checked)), threads)


def edge_face_intersect(points: np.ndarray, threads: int = 0) -> np.ndarray:
    """Whether (Q,) a closed edge and a closed face share a point. points: (Q,5,3), two ends, three corners."""
    return _oracle.edge_face_intersect(_checked("points", points, 5), threads)


def _squared(function: Callable[[np.ndarray], tuple[str, str, int]], points: np.ndarray) -> list[Fraction]:
    squares = []
    for row in _checked("points", points, 4):
        numerator, denominator, exponent = function(row[None])
        squares.append(Fraction(int(numerator, 16), int(denominator, 16)) * Fraction(4) ** exponent)
    return squares


def _hit_and_toc(toc: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.isfinite(toc), toc


def _distances(distance: ArrayLike, count: int) -> np.ndarray:
    distances = np.asarray(distance, dtype=np.float64)
    if distances.shape not in ((), (count,)):
        raise ValueError(f"distance: shape {distances.shape}, expected one number or ({count},)")
    if not np.isfinite(distances).all() or (distances < 0).any():
        raise ValueError("distance: negative, NaN or Inf")
    return np.ascontiguousarray(np.broadcast_to(distances, (count,)))


def _checked(name: str, points: np.ndarray, n_points: int) -> np.ndarray:
    points = np.asarray(points, dtype=np.float64)
    if points.ndim != 3 or points.shape[1:] != (n_points, 3):
        raise ValueError(f"{name}: shape {points.shape}, expected (Q, {n_points}, 3)")
    if not np.isfinite(points).all():
        raise ValueError(f"{name}: NaN or Inf")
    return points
