# SPDX-License-Identifier: Apache-2.0
"""Points at one position become one vertex."""

import numpy as np
from numpy.typing import NDArray


def weld(points: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Join equal points, in order of first use.

    Parameters
    ----------
    points : (n, 3) float64
        Points are one vertex where their coordinates are equal number for number; -0 equals 0.

    Returns
    -------
    first : (v,) intp
        The first point of each vertex, increasing.
    vertex_of : (n,) intp
        The vertex of each point.

    Notes
    -----
    Every step that takes long runs without the interpreter lock: ``numpy.unique(axis=0)`` would hold it for seconds
    where there are millions of points, and with it all other threads.
    """
    bits = np.ascontiguousarray(points + 0.0).view(np.uint64)  # + 0.0 makes 0 of -0
    order = np.lexsort(bits.T)  # stable: of equal points the first one comes first
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
