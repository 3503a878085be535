# SPDX-License-Identifier: Apache-2.0
"""The elementary tests by themselves, many queries at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core, arguments
from .options import ACCURACIES, SIMD, Accuracy, Simd


def test_vertex_face(
    queries: ArrayLike,
    accuracy: Accuracy = "exact",
    *,
    simd: Simd = "auto",
    minimum_separation: float = 0.0,
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Whether and when moving vertices touch moving triangles.

    Parameters
    ----------
    queries : ArrayLike, shape (Q, 8, 3), float32 or float64
        Points v f0 f1 f2 at t=0, then the same at t=1.
    accuracy : {"exact", "conservative", "balanced", "fast"}
        As for :class:`Detector`.
    simd : {"auto", "scalar", "avx2", "avx512", "neon"}
        CPU instruction set. Results are the same.
    minimum_separation : float
        As for :class:`Detector`.

    Returns
    -------
    hit : ndarray, shape (Q,), bool
    toc : ndarray, shape (Q,), float64
        Earliest time of impact in [0, 1]; +inf without contact.

    Raises
    ------
    TypeError, ValueError
        If an argument has the wrong type or shape, or a coordinate is not finite.

    Examples
    --------
    >>> import numpy as np
    >>> import hpccd_core as hc
    >>> face = [[-1, -1, 0], [1, -1, 0], [0, 1, 0]]
    >>> hit, toc = hc.test_vertex_face(np.array([[[0, 0, 1], *face, [0, 0, -3], *face]], float))
    >>> hit.tolist(), toc.tolist()
    ([True], [0.25])
    """
    return _test(_core.test_vertex_face, queries, accuracy, simd, minimum_separation)


def test_edge_edge(
    queries: ArrayLike,
    accuracy: Accuracy = "exact",
    *,
    simd: Simd = "auto",
    minimum_separation: float = 0.0,
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Whether and when moving edges touch each other.

    Parameters
    ----------
    queries : ArrayLike, shape (Q, 8, 3), float32 or float64
        Points a0 a1 b0 b1 at t=0, then the same at t=1.
    accuracy : {"exact", "conservative", "balanced", "fast"}
        As for :class:`Detector`.
    simd : {"auto", "scalar", "avx2", "avx512", "neon"}
        CPU instruction set. Results are the same.
    minimum_separation : float
        As for :class:`Detector`.

    Returns
    -------
    hit : ndarray, shape (Q,), bool
    toc : ndarray, shape (Q,), float64
        Earliest time of impact in [0, 1]; +inf without contact.

    Raises
    ------
    TypeError, ValueError
        If an argument has the wrong type or shape, or a coordinate is not finite.
    """
    return _test(_core.test_edge_edge, queries, accuracy, simd, minimum_separation)


def _test(
    function: Callable[..., tuple[NDArray[np.bool_], NDArray[np.float64]]],
    queries: ArrayLike,
    accuracy: Accuracy,
    simd: Simd,
    minimum_separation: float,
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    arguments.choice("accuracy", accuracy, ACCURACIES)
    arguments.choice("simd", simd, SIMD)
    checked = arguments.queries(queries)
    separation = arguments.length("minimum_separation", minimum_separation)
    return function(checked, getattr(_core.Accuracy, accuracy), getattr(_core.Simd, simd), separation)


# The names begin like tests; they are not.
test_vertex_face.__test__ = False  # type: ignore[attr-defined]
test_edge_edge.__test__ = False  # type: ignore[attr-defined]
