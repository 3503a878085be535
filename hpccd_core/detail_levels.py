# SPDX-License-Identifier: Apache-2.0
"""Coarse faces of a mesh on its own vertices, and the patches of its faces that they stand for."""

from __future__ import annotations

import dataclasses
import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from .mesh_layout import Indices

#: Fewer faces are not made coarser.
FEWEST_FACES = 8

_NO_VERTEX = np.uint32(2**32 - 1)


def simplifier() -> Any:
    """The module fast_simplification. Raises ImportError with the remedy if it is not installed."""
    try:
        return importlib.import_module("fast_simplification")
    except ImportError as error:
        raise ImportError(
            f"detail: needs the Python package fast-simplification ({error}); install it by "
            "pip install 'hpccd-core[detail]' or pip install fast-simplification"
        ) from error


@dataclasses.dataclass(frozen=True, eq=False)
class CoarseFaces:
    """A proposal: coarse faces (C, 3) on the vertices of a mesh, and the surviving vertex of each of its vertices."""

    faces: Indices
    survivor: Indices


def propose(faces: Indices, rest: NDArray[np.float64], ratio: float) -> CoarseFaces:
    """Coarse faces, about `ratio` times as many: edge collapses by quadric error (Garland and Heckbert, "Surface
    simplification using quadric error metrics", SIGGRAPH 1997), each result moved to a vertex that collapsed into it.

    Parameters
    ----------
    faces : ndarray, shape (F, 3), uint32
        Of the mesh.
    rest : ndarray, shape (V, 3), float64
        The shape that is simplified.
    ratio : float
        In (0, 1].

    Returns
    -------
    CoarseFaces
        All faces if there are too few.
    """
    survivor = np.full(len(rest), _NO_VERTEX)
    used = np.unique(faces)
    survivor[used] = used
    as_it_is = CoarseFaces(faces, survivor.copy())
    proper = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
    if ratio >= 1 or len(faces) < FEWEST_FACES or len(proper) < FEWEST_FACES:
        return as_it_is
    fast_simplification = simplifier()
    used, local = np.unique(proper, return_inverse=True)
    triangles = np.ascontiguousarray(local.reshape(-1, 3), np.int64)
    points = rest[used] - (rest[used].min(axis=0) / 2 + rest[used].max(axis=0) / 2)
    # Its thresholds are for a mesh of size 1.
    points /= np.abs(points).max() or 1.0
    rough = points + _noise(points, triangles)
    *_, collapses = fast_simplification.simplify(rough, triangles, 1 - ratio, return_collapses=True)
    places, coarse, cluster = fast_simplification.replay_simplification(rough, triangles, collapses)
    if not len(coarse):  # it may collapse everything
        return as_it_is
    # In each cluster the vertex nearest to the place of the collapse; of several the first. On the border of the mesh,
    # one of its corners, or any on it: a coarse border beside that of the mesh leaves its faces half an edge away.
    away = np.linalg.norm(points - places[cluster], axis=1)
    order = np.lexsort((np.arange(len(used)), away, -_on_border(points, triangles), cluster))
    clusters, first = np.unique(cluster[order], return_index=True)
    vertex_of = np.full(len(places), _NO_VERTEX)
    vertex_of[clusters] = used[order[first]]
    alive = np.zeros(len(places), bool)
    alive[coarse] = True
    survivor[used] = np.where(alive[cluster], vertex_of[cluster], _NO_VERTEX)
    return CoarseFaces(np.ascontiguousarray(vertex_of[coarse], np.uint32), survivor)


def _on_border(points: NDArray[np.float64], triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """(V,): 1 for vertices on an edge of one face only, 2 where that border turns or branches, 0 for others."""
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges, count = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    border = edges[count == 1]
    n_edges = np.bincount(border.ravel(), minlength=len(points))
    along = points[border[:, 1]] - points[border[:, 0]]
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), np.finfo(float).tiny)
    away = np.zeros_like(points)  # the sum of both directions away from a vertex: 0 on a straight border
    np.add.at(away, border[:, 0], along)
    np.add.at(away, border[:, 1], -along)
    turns = (n_edges != 2) | (np.linalg.norm(away, axis=1) > 0.5)
    return np.where(n_edges == 0, 0, np.where(turns, 2, 1))


def _noise(points: NDArray[np.float64], triangles: NDArray[np.int64]) -> NDArray[np.float64]:
    """Noise of a fifth of the edges. Where a surface is flat, no collapse costs anything, and needles result: a net of
    245,000 triangles ended at 126,000 instead of 24,500. With noise coarse faces are compact."""
    vertices = triangles.ravel()
    lengths = np.linalg.norm(points[triangles] - points[np.roll(triangles, 1, axis=1)], axis=2).ravel()
    mean = np.bincount(vertices, lengths, len(points)) / np.bincount(vertices, minlength=len(points))
    noise: NDArray[np.float64] = np.random.default_rng(45).normal(size=points.shape) * (mean[:, None] / 5)
    return noise


class Level:
    """One level of detail of one mesh.

    Parameters
    ----------
    mesh : _core.CoarseMesh
    n_faces : int
        Faces of the mesh.
    kept_vertices : ndarray, uint32
        Vertices of the mesh that are in no face, or in an edge of no face: they stay.
    """

    def __init__(self, mesh: _core.CoarseMesh, n_faces: int, kept_vertices: Indices) -> None:
        self.mesh, self.faces, self.held = mesh, mesh.faces, mesh.held
        #: Whether nothing became coarser.
        self.same = len(self.faces) >= n_faces
        self.vertices = np.union1d(self.faces, kept_vertices).astype(np.uint32)  # of the mesh that are tested
        self._begin = np.searchsorted(self.held[:, 0], np.arange(len(self.faces)))

    def greatest(self, of_faces: NDArray[np.float64]) -> NDArray[np.float64]:
        """(C,): of values (1,) or (F,) of the faces of the mesh the greatest in each patch."""
        if len(of_faces) == 1 or not len(self.faces):
            return np.broadcast_to(of_faces[:1], len(self.faces))
        greatest: NDArray[np.float64] = np.maximum.reduceat(of_faces[self.held[:, 1]], self._begin)
        return greatest
