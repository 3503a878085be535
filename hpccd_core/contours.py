# SPDX-License-Identifier: Apache-2.0
"""Intersection curves, and what they enclose."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from .mesh_layout import Indices
from .worlds import ComparedByRows


@dataclasses.dataclass(frozen=True, eq=False)
class Contour(ComparedByRows):
    """A polyline along which two meshes, or two parts of one mesh, intersect.

    :meth:`Intersections.contours` returns a list of them. Contours are equal if all fields are; they are not hashable.

    Attributes
    ----------
    rows : ndarray, shape (n,), uint32
        Rows of the intersections, in order along the curve. Neighbouring rows belong to one pair of triangles, or have
        the same point: an edge that passes through an edge or a vertex has several rows there.
    points : ndarray, shape (n, 3), float64
        The points of these rows.
    closed : bool
        Whether the last row is followed by the first, which is not repeated. Otherwise the curve ends at a border, at a
        vertex of both sides (where a mesh begins to intersect itself) or where three or more curves meet; or it is a
        single point.
    mesh_a, mesh_b : str
        Names; `mesh_a` was added before `mesh_b`, or is the same.
    """

    rows: Indices
    points: NDArray[np.float64]
    closed: bool
    mesh_a: str
    mesh_b: str

    @property
    def length(self) -> float:
        """Length of the polyline, in the unit of the coordinates, without segments to vertices of both sides."""
        ends = np.concatenate([self.points, self.points[:1]]) if self.closed else self.points
        return float(np.linalg.norm(np.diff(ends, axis=0), axis=1).sum())

    def __len__(self) -> int:
        return len(self.rows)

    def __repr__(self) -> str:
        kind = "closed" if self.closed else "open"
        return f"Contour({self.mesh_a} and {self.mesh_b}, {len(self.rows)} points, {kind})"


@dataclasses.dataclass(frozen=True, eq=False)
class EnclosedRegion(ComparedByRows):
    """The vertices that a contour encloses on both sides.

    :meth:`Intersections.regions` returns a list of them.

    Attributes
    ----------
    vertices_a, vertices_b : ndarray, uint32
        Scene-wide vertices of `mesh_a` and `mesh_b` of the contour, ascending.
    """

    vertices_a: Indices
    vertices_b: Indices
