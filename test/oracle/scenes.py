# SPDX-License-Identifier: Apache-2.0
"""All results of a scene, by exact tests of every pair whose boxes overlap.

Arguments of all: faces_per_mesh: for each mesh (F,3) integers, indices into its own vertices. n_vertices: for each
mesh, by default one more than its largest index. edges_per_mesh: for each mesh (E,2) integers, likewise: edges beside
those of its faces. Not tested: features that share a vertex, meshes in
`no_self_collision` against themselves, `static` ones against themselves and each other, and `ignored_pairs` (all by
position in faces_per_mesh). Vertices that belong to no face are tested against faces too; an edge from a vertex to
itself is none. Positions are (V,3), finite, all meshes' vertices one after the other. Raise ValueError if shapes or
counts do not match. threads: 0 = all cores.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import _oracle
import numpy as np
from numpy.typing import ArrayLike

from hpccd_core.worlds import ComparedByRows


@dataclass(frozen=True, eq=False)
class Contacts(ComparedByRows):
    """Contacts in the core's canonical order.

    vf: (N,2) uint32, vertex and face; ee: (M,4) uint32, a0<a1, b0<b1, (a0,a1)<(b0,b1); both scene-wide indices, sorted
    lexicographically. vf_toc (N,) and ee_toc (M,) float64 in [0,1].
    """

    vf: np.ndarray
    vf_toc: np.ndarray
    ee: np.ndarray
    ee_toc: np.ndarray


@dataclass(frozen=True, eq=False)
class Proximity(ComparedByRows):
    """Pairs as in Contacts, with their distances rounded to the nearest double."""

    vf: np.ndarray
    vf_distance: np.ndarray
    ee: np.ndarray
    ee_distance: np.ndarray


class Gap(NamedTuple):
    """Two meshes by number, mesh_a <= mesh_b, and how near they are; +inf where they have no pair of features.

    intersect: an edge of one and a face of the other share a point, and the distance is 0.
    """

    mesh_a: int
    mesh_b: int
    distance: float
    intersect: bool


def brute_force(
    vertices_t0: np.ndarray,
    vertices_t1: np.ndarray,
    faces_per_mesh: Sequence[np.ndarray],
    *,
    minimum_separation: float = 0.0,
    pair_separation: Mapping[tuple[int, int], float] | None = None,
    threads: int = 0,
    **scene: Any,
) -> Contacts:
    """All contacts of one step of a scene; with a separation, all pairs that come within it.

    pair_separation: those of some pairs of meshes, by position, which beat minimum_separation.
    """
    parts = _Scene(faces_per_mesh, **scene)
    separations = np.full((len(faces_per_mesh),) * 2, float(minimum_separation))
    for (a, b), separation in (pair_separation or {}).items():
        separations[a, b] = separations[b, a] = separation
    if not np.isfinite(separations).all() or (separations < 0).any():
        raise ValueError("minimum_separation, pair_separation: negative, NaN or Inf")
    v0, v1 = parts.positions("vertices_t0", vertices_t0), parts.positions("vertices_t1", vertices_t1)
    return Contacts(*_oracle.contacts(parts.meshes, v0, v1, separations.tolist(), threads))


def earliest_contacts(
    vertices_t0: np.ndarray,
    vertices_t1: np.ndarray,
    faces_per_mesh: Sequence[np.ndarray],
    *,
    minimum_separation: ArrayLike = 0.0,
    threads: int = 0,
    **scene: Any,
) -> np.ndarray:
    """The earliest contact times (N,) of N steps (N,V,3) of one scene, rounded down; +inf where nothing touches.

    minimum_separation: one for all, or (N,), one for each step.
    """
    parts = _Scene(faces_per_mesh, **scene)
    starts, ends = (np.asarray(v, dtype=np.float64) for v in (vertices_t0, vertices_t1))
    for name, vertices in (("vertices_t0", starts), ("vertices_t1", ends)):
        if vertices.ndim != 3 or vertices.shape != starts.shape:
            raise ValueError(f"{name}: shape {vertices.shape}, expected (N, V, 3), the same for both")
        parts.positions(name, vertices.reshape(-1, 3)[: vertices.shape[1]])
        if not np.isfinite(vertices).all():
            raise ValueError(f"{name}: NaN or Inf")
    distances = np.ascontiguousarray(np.broadcast_to(np.asarray(minimum_separation, np.float64), (len(starts),)))
    if not np.isfinite(distances).all() or (distances < 0).any():
        raise ValueError("minimum_separation: negative, NaN or Inf")
    return _oracle.earliest_contacts(parts.meshes, starts, ends, distances, threads)


def proximity(
    vertices: np.ndarray, distance: float, faces_per_mesh: Sequence[np.ndarray], *, threads: int = 0, **scene: Any
) -> Proximity:
    """All vertex-face and edge-edge pairs within a distance of each other."""
    parts = _Scene(faces_per_mesh, **scene)
    if not 0 <= distance < np.inf:
        raise ValueError(f"distance: {distance} is negative or not finite")
    return Proximity(*_oracle.proximity(parts.meshes, parts.positions("vertices", vertices), distance, threads))


def intersections(
    vertices: np.ndarray, faces_per_mesh: Sequence[np.ndarray], *, threads: int = 0, **scene: Any
) -> np.ndarray:
    """Edges that intersect or touch faces: (K,3) uint32, a0<a1, face, sorted lexicographically."""
    parts = _Scene(faces_per_mesh, **scene)
    return _oracle.intersections(parts.meshes, parts.positions("vertices", vertices), threads)


def smallest_distances(
    vertices: np.ndarray, faces_per_mesh: Sequence[np.ndarray], *, threads: int = 0, **scene: Any
) -> list[Gap]:
    """The smallest distance of each two meshes that are tested, and within each mesh that is."""
    parts = _Scene(faces_per_mesh, **scene)
    positions = parts.positions("vertices", vertices)
    return [Gap(*gap) for gap in _oracle.smallest_distances(parts.meshes, positions, threads)]


class _Scene:
    """Checked meshes, and which pairs of them are tested."""

    def __init__(
        self,
        faces_per_mesh: Sequence[np.ndarray],
        *,
        edges_per_mesh: Sequence[np.ndarray] | None = None,
        n_vertices: Sequence[int] | None = None,
        no_self_collision: Iterable[int] = (),
        static: Iterable[int] = (),
        ignored_pairs: Iterable[tuple[int, int]] = (),
    ) -> None:
        faces_per_mesh = [np.asarray(f, dtype=np.int64).reshape(-1, 3) for f in faces_per_mesh]
        given = edges_per_mesh if edges_per_mesh is not None else [()] * len(faces_per_mesh)
        edges_per_mesh = [np.asarray(e, dtype=np.int64).reshape(-1, 2) for e in given]
        if n_vertices is None:
            n_vertices = [
                max(int(a.max()) + 1 if len(a) else 0 for a in both)
                for both in zip(faces_per_mesh, edges_per_mesh, strict=True)
            ]
        for name, features in (("faces_per_mesh", faces_per_mesh), ("edges_per_mesh", edges_per_mesh)):
            for mesh, (indices, count) in enumerate(zip(features, n_vertices, strict=True)):
                if len(indices) and not 0 <= indices.min() <= indices.max() < count:
                    raise ValueError(f"{name}[{mesh}]: indices must lie in 0..{count - 1}")
        self.n_vertices = sum(n_vertices)
        offsets = np.concatenate([[0], np.cumsum(n_vertices)])
        tested = np.ones((len(faces_per_mesh), len(faces_per_mesh)), dtype=np.uint8)
        for mesh in no_self_collision:
            tested[mesh, mesh] = 0
        for a, b in ignored_pairs:
            tested[a, b] = tested[b, a] = 0
        tested[np.ix_(list(static), list(static))] = 0
        self.meshes = _oracle.Meshes(
            np.concatenate([f + o for f, o in zip(faces_per_mesh, offsets, strict=False)]).astype(np.uint32),
            np.concatenate([e + o for e, o in zip(edges_per_mesh, offsets, strict=False)]).astype(np.uint32),
            np.repeat(np.arange(len(n_vertices)), n_vertices).tolist(),
            tested.tolist(),
        )

    def positions(self, name: str, vertices: np.ndarray) -> np.ndarray:
        vertices = np.asarray(vertices, dtype=np.float64)
        if vertices.ndim != 2 or vertices.shape[1] != 3:
            raise ValueError(f"{name}: shape {vertices.shape}, expected (V, 3)")
        if len(vertices) != self.n_vertices:
            raise ValueError(f"{name}: the meshes have {self.n_vertices} vertices, {len(vertices)} were given")
        if not np.isfinite(vertices).all():
            raise ValueError(f"{name}: NaN or Inf")
        return vertices
