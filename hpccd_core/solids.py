# SPDX-License-Identifier: Apache-2.0
"""Closed meshes: what makes a mesh closed, and signed distances from one."""

from __future__ import annotations

import dataclasses
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _core, arguments
from .array_types import ArrayLike
from .mesh_layout import Indices
from .worlds import ComparedByRows


def closed(faces: ArrayLike) -> bool:
    """Whether a mesh is closed: each edge is in exactly two faces, which are oriented consistently.

    Parameters
    ----------
    faces : ArrayLike, shape (F, 3), integers
        As for :meth:`Scene.add_mesh`. A face that names a vertex twice does not count.

    Returns
    -------
    bool
        False without faces.

    Raises
    ------
    TypeError, ValueError
        If `faces` has the wrong type or shape.

    Notes
    -----
    Consistently: the two faces list the vertices of the edge in opposite orders. Positions do not matter: two vertices
    at the same position are two vertices, so a file that lists the corners of each triangle has no closed mesh.

    Examples
    --------
    >>> import hpccd_core as hc
    >>> vertices, faces = hc.shapes.icosphere(2)
    >>> hc.closed(faces), hc.closed(faces[1:])
    (True, False)
    """
    return _core.is_closed(arguments.faces(faces))


@dataclasses.dataclass(frozen=True, eq=False)
class SignedDistances(ComparedByRows):
    """Signed distances of K points to a closed mesh, made by :meth:`Detector.signed_distances`.

    With worlds, arrays have W as their first axis.

    Attributes
    ----------
    distance : ndarray, shape (K,), float64
        Euclidean distance to the surface, in the unit of the coordinates: negative where the winding number is not 0,
        and 0 exactly where the point is on the surface.
    faces : ndarray, shape (K,), uint32
        Scene-wide indices of the nearest faces, as in ``contacts.vf[:, 1]``; see :meth:`Scene.locate`. Of several
        faces at the same distance, the lowest.
    closest : ndarray, shape (K, 3), float64
        The nearest point on that face.
    """

    distance: NDArray[np.float64]
    faces: Indices
    closest: NDArray[np.float64]

    def __repr__(self) -> str:
        inside: Any = np.count_nonzero(self.distance < 0)
        return f"SignedDistances({self.distance.size} points, {inside} inside)"


@dataclasses.dataclass(frozen=True, eq=False)
class Penetration(ComparedByRows):
    """A translation that separates two meshes, made by :meth:`Detector.penetration`.

    Attributes
    ----------
    translation : ndarray, shape (3,), float64
        Of mesh a. Zero if the meshes are free of each other.
    depth : float
        Its length.
    lower_bound : float
        No shorter translation separates the meshes: the distance of the deepest vertex of either mesh inside the
        closed other one from its surface. 0 without such a vertex.
    kind : {"vertex-face", "edge-edge", ""}
        The features that touch after the translation; empty if the meshes are free, or if no pair of features
        determines the result.
    features : tuple of int
        Scene-wide: vertex and face, or the vertices of an edge of a and of an edge of b.
    """

    translation: NDArray[np.float64]
    depth: float
    lower_bound: float
    kind: Literal["vertex-face", "edge-edge", ""]
    features: tuple[int, ...]
