# SPDX-License-Identifier: Apache-2.0
"""Join points at equal positions to vertices."""

import numpy as np
from numpy.typing import NDArray


def weld(points: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Join equal points, in order of first use.

    Parameters
    ----------
    points : (n, 3) float64
        Points with equal coordinates become one vertex; -0 equals 0.

    Returns
    -------
    first : (v,) intp
        The first point of each vertex, increasing.
    vertex_of : (n,) intp
        The vertex of each point.

    Notes
    -----
    Every step that takes long runs without the interpreter lock. ``numpy.unique(axis=0)`` would hold the lock, and so
    block all other threads, for seconds with millions of points.
    """
    bits = np.ascontiguousarray(points + 0.0).view(np.uint64)  # + 0.0 makes 0 of -0
    order = np.lexsort(bits.T)  # stable: equal points stay in order
    ordered = bits[order]
    starts = np.ones(len(order), bool)
    starts[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    first = order[starts]
    by_first = np.argsort(first)
    rank = np.empty_like(by_first)
    rank[by_first] = np.arange(len(by_first))
    vertex_of = np.empty_like(order)
    vertex_of[order] = rank[np.cumsum(starts) - 1]
    return first[by_first], vertex_of
