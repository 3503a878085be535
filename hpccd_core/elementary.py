# SPDX-License-Identifier: Apache-2.0
"""The elementary tests by themselves, many queries at once."""

from . import _core, arguments
from .scene import ACCURACIES


def test_vertex_face(queries, accuracy="exact", *, simd="auto", minimum_separation=0.0, tolerance=1e-6):
    """Whether and when moving vertices touch moving triangles.

    queries: (Q, 8, 3) float32 or float64, rows v f0 f1 f2 at t=0, then the same at t=1. accuracy: as for Detector.
    simd: "auto", "scalar", "avx2" or "avx512"; the result is the same. minimum_separation, tolerance: as for Detector.
    Returns hit (Q,) bool and toc (Q,) float64,
    +inf where there is no contact.
    """
    return _test(_core.test_vertex_face, queries, accuracy, simd, minimum_separation, tolerance)


def test_edge_edge(queries, accuracy="exact", *, simd="auto", minimum_separation=0.0, tolerance=1e-6):
    """Whether and when moving edges touch. Rows a0 a1 b0 b1 at t=0, then the same at t=1; else as test_vertex_face."""
    return _test(_core.test_edge_edge, queries, accuracy, simd, minimum_separation, tolerance)


def _test(function, queries, accuracy, simd, minimum_separation, tolerance):
    accuracy = arguments.choice("accuracy", accuracy, ACCURACIES)
    simd = arguments.choice("simd", simd, ("auto", "scalar", "avx2", "avx512"))
    queries = arguments.queries(queries)
    lengths = arguments.separation(accuracy, minimum_separation, tolerance)
    return function(queries, getattr(_core.Accuracy, accuracy), getattr(_core.Simd, simd), *lengths)


# The names begin like tests; they are not.
test_vertex_face.__test__ = False
test_edge_edge.__test__ = False
