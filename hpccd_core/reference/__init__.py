# SPDX-License-Identifier: Apache-2.0
"""Slow oracles that the core is compared with: exact elementary tests and brute force over all pairs.

Everything is decided in integer arithmetic of any size on the coordinates as given; nothing is shared with the core's
own arithmetic or traversal. Meaning of a contact as in Kim et al. 2009, section 3.1: vertices move on straight lines,
features are closed, touching counts, `toc` is the earliest time in [0,1].
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from .. import _reference

__all__ = ["Contacts", "brute_force", "edge_edge", "vertex_face"]


@dataclass(frozen=True)
class Contacts:
    """Contacts in the core's canonical order.

    vf: (N,2) uint32, vertex and face; ee: (M,4) uint32, a0<a1, b0<b1, (a0,a1)<(b0,b1); both scene-wide indices, sorted
    lexicographically. vf_toc (N,) and ee_toc (M,) float64 in [0,1].
    """

    vf: np.ndarray
    vf_toc: np.ndarray
    ee: np.ndarray
    ee_toc: np.ndarray


def vertex_face(queries: np.ndarray, threads: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Exact contact of a moving vertex and a moving closed triangle.

    queries: (Q,8,3) finite float32 or float64; rows v f0 f1 f2 at t=0, then the same at t=1. threads: 0 = all cores.
    Returns hit (Q,) bool and toc (Q,) float64: the earliest time of contact rounded down to a double, +inf where there
    is none. Raises ValueError on a wrong shape or on NaN and Inf.
    """
    return _reference.vertex_face(_checked_queries(queries), threads)


def edge_edge(queries: np.ndarray, threads: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Exact contact of two moving closed segments.

    queries: (Q,8,3) finite float32 or float64; rows a0 a1 b0 b1 at t=0, then the same at t=1. Everything else as
    in `vertex_face`.
    """
    return _reference.edge_edge(_checked_queries(queries), threads)


def brute_force(
    vertices_t0: np.ndarray,
    vertices_t1: np.ndarray,
    faces_per_mesh: Sequence[np.ndarray],
    *,
    n_vertices: Sequence[int] | None = None,
    no_self_collision: Iterable[int] = (),
    static: Iterable[int] = (),
    ignored_pairs: Iterable[tuple[int, int]] = (),
    threads: int = 0,
) -> Contacts:
    """All contacts of one step of a scene, by the exact tests on every pair whose swept boxes meet.

    vertices_t0, vertices_t1: (V,3) finite, all meshes' vertices one after the other. faces_per_mesh: for each mesh
    (F,3) integers, indices into its own vertices. n_vertices: for each mesh, by default one more than its largest
    index. Not tested: features that share a vertex, meshes in `no_self_collision` against themselves, `static` ones
    against themselves and each other, and `ignored_pairs` (all by position in faces_per_mesh). Vertices that belong to
    no face are tested against faces too; an edge from a vertex to itself is none. Raises ValueError where shapes or
    counts do not fit together.
    """
    faces_per_mesh = [np.asarray(f, dtype=np.int64).reshape(-1, 3) for f in faces_per_mesh]
    if n_vertices is None:
        n_vertices = [int(f.max()) + 1 if len(f) else 0 for f in faces_per_mesh]
    for mesh, (faces, count) in enumerate(zip(faces_per_mesh, n_vertices, strict=True)):
        if len(faces) and not 0 <= faces.min() <= faces.max() < count:
            raise ValueError(f"faces_per_mesh[{mesh}]: indices must lie in 0..{count - 1}")
    v0, v1 = (_checked_vertices(name, v) for name, v in (("vertices_t0", vertices_t0), ("vertices_t1", vertices_t1)))
    if not len(v0) == len(v1) == sum(n_vertices):
        raise ValueError(f"vertices: the meshes have {sum(n_vertices)}, vertices_t0 {len(v0)}, vertices_t1 {len(v1)}")

    offsets = np.concatenate([[0], np.cumsum(n_vertices)])
    tested = np.ones((len(faces_per_mesh), len(faces_per_mesh)), dtype=np.uint8)
    for mesh in no_self_collision:
        tested[mesh, mesh] = 0
    for a, b in ignored_pairs:
        tested[a, b] = tested[b, a] = 0
    tested[np.ix_(list(static), list(static))] = 0
    found = _reference.brute_force(
        v0,
        v1,
        np.concatenate([f + o for f, o in zip(faces_per_mesh, offsets, strict=False)]).astype(np.uint32),
        np.repeat(np.arange(len(n_vertices)), n_vertices).tolist(),
        tested.tolist(),
        threads,
    )
    return Contacts(**found)


def _checked_queries(queries: np.ndarray) -> np.ndarray:
    queries = np.asarray(queries, dtype=np.float64)
    if queries.ndim != 3 or queries.shape[1:] != (8, 3):
        raise ValueError(f"queries: shape {queries.shape}, expected (Q, 8, 3)")
    if not np.isfinite(queries).all():
        raise ValueError("queries: NaN or Inf")
    return queries


def _checked_vertices(name: str, vertices: np.ndarray) -> np.ndarray:
    vertices = np.asarray(vertices, dtype=np.float64)
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise ValueError(f"{name}: shape {vertices.shape}, expected (V, 3)")
    if not np.isfinite(vertices).all():
        raise ValueError(f"{name}: NaN or Inf")
    return vertices
