# SPDX-License-Identifier: Apache-2.0
"""The elementary tests by themselves, many queries at once."""

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

    queries: (Q, 8, 3) float32 or float64, rows v f0 f1 f2 at t=0, then the same at t=1. accuracy: as for Detector.
    simd: "auto", "scalar", "avx2", "avx512" (x86-64) or "neon" (aarch64); the result is the same.
    minimum_separation: as for Detector. Returns hit (Q,) bool and toc (Q,) float64, +inf where there is no contact.
    """
    return _test(_core.test_vertex_face, queries, accuracy, simd, minimum_separation)


def test_edge_edge(
    queries: ArrayLike,
    accuracy: Accuracy = "exact",
    *,
    simd: Simd = "auto",
    minimum_separation: float = 0.0,
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Whether and when moving edges touch. Rows a0 a1 b0 b1 at t=0, then the same at t=1; else as test_vertex_face."""
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
