# SPDX-License-Identifier: Apache-2.0
"""Smallest distances of pairs of meshes: the node's message as numpy arrays."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from hpccd.msg import DistanceArray
from numpy.typing import NDArray

from hpccd_ros.client.contacts import field, meshes_of
from hpccd_ros.client.names import belongs, check
from hpccd_ros.middleware import result_fields


@dataclass(frozen=True, eq=False)
class DistanceArrays:
    """The smallest distance of P pairs of meshes at one time; a mesh with itself is a pair too.

    Features are numbered within their mesh. Arrays are views of the message.

    Attributes
    ----------
    mesh_names : tuple of str
        Meshes of the scene.
    distance : ndarray, shape (P,), float64
        In the unit of the scene, between the thick surfaces: negative where these overlap. +inf if no pair of features
        exists.
    kind : ndarray, shape (P,), uint8
        ``DistanceArray.VERTEX_FACE``, ``EDGE_EDGE``, ``EDGE_FACE`` (they intersect), ``VERTEX_PLANE``,
        ``VERTEX_VERTEX``, ``VERTEX_EDGE`` or ``NO_PAIR``.
    mesh_a, mesh_b : ndarray, shape (P,), uint32
        The mesh of each side: indices into `mesh_names`. The vertex or edge that is near a face is of `mesh_a`.
    features_a : ndarray, shape (P, 2), uint32
        Side a, of `mesh_a`: vertex and ``DistanceArray.NONE``, or both vertices of the edge.
    features_b : ndarray, shape (P, 2), uint32
        Side b, of `mesh_b`: face and ``DistanceArray.NONE``, both vertices of the edge, a point and ``NONE``, or twice
        ``NONE`` for a plane.
    points : ndarray, shape (P, 2, 3), float64
        Nearest points of both sides, in the unit of the scene.
    direction : ndarray, shape (P, 3), float64
        Unit vector from the nearest point of `mesh_a` to that of `mesh_b`; 0 if unknown.
    approach_speed : ndarray, shape (P,), float64
        Decrease of the distance per second since the last snapshot; NaN if unknown.
    time_to_contact : ndarray, shape (P,), float64
        Seconds until the meshes touch if they go on as they do; +inf if they do not approach, NaN if unknown.
    inside : ndarray, shape (P,), uint8
        ``DistanceArray.INSIDE_NONE``, ``INSIDE_A`` (`mesh_a` lies inside `mesh_b`), ``INSIDE_B`` or ``INSIDE_BOTH``.
    nearest : int or None
        Row of the nearest pair of different meshes; None if there is none.
    thickness : dict of str to float
        Thickness of the meshes that have one.
    """

    mesh_names: tuple[str, ...]
    distance: NDArray[np.float64]
    kind: NDArray[np.uint8]
    mesh_a: NDArray[np.uint32]
    mesh_b: NDArray[np.uint32]
    features_a: NDArray[np.uint32]
    features_b: NDArray[np.uint32]
    points: NDArray[np.float64]
    direction: NDArray[np.float64]
    approach_speed: NDArray[np.float64]
    time_to_contact: NDArray[np.float64]
    inside: NDArray[np.uint8]
    nearest: int | None
    thickness: dict[str, float]

    def __len__(self) -> int:
        return len(self.distance)

    def between(self, mesh_a: str, mesh_b: str) -> float:
        """The smallest distance of two meshes, of a robot and a mesh, or of two robots.

        Parameters
        ----------
        mesh_a, mesh_b : str
            Names in either order: of a mesh, of a link (``"arm/hand"``), or of a robot (``"arm"``: all of its links).
            The same name twice: within that mesh or robot.

        Returns
        -------
        float
            In the unit of the scene; +inf if they are not tested against each other.

        Raises
        ------
        TypeError, ValueError
            If a name is not a string, or is of no mesh or robot.
        """
        for argument, name in (("mesh_a", mesh_a), ("mesh_b", mesh_b)):
            check(argument, name, self.mesh_names)
        of_a, of_b = (np.array([belongs(mesh, name) for mesh in self.mesh_names]) for name in (mesh_a, mesh_b))
        wanted = (of_a[self.mesh_a] & of_b[self.mesh_b]) | (of_b[self.mesh_a] & of_a[self.mesh_b])
        return float(self.distance[wanted].min(initial=math.inf))


def distances_from_message(message: DistanceArray) -> DistanceArrays:
    """The distances of a message as arrays.

    Parameters
    ----------
    message : hpccd.msg.DistanceArray

    Returns
    -------
    DistanceArrays

    Raises
    ------
    ValueError
        If the arrays of the message are inconsistent; those of the node never are.
    """
    count = len(message.distance)
    n_directed = len(message.direction) or len(message.approach_speed)
    n_timed = len(message.time_to_contact) or len(message.inside)
    return DistanceArrays(
        tuple(message.mesh_names),
        distance=field(message, "distance", np.float64, (count,)),
        kind=field(message, "kind", np.uint8, (count,)),
        mesh_a=meshes_of(message, "mesh_a", count),
        mesh_b=meshes_of(message, "mesh_b", count),
        features_a=field(message, "features_a", np.uint32, (count, 2)),
        features_b=field(message, "features_b", np.uint32, (count, 2)),
        points=field(message, "points", np.float64, (count, 2, 3)),
        direction=field(message, "direction", np.float64, (count, 3)) if n_directed else np.zeros((count, 3)),
        approach_speed=field(message, "approach_speed", np.float64, (count,)) if n_directed else np.full(count, np.nan),
        time_to_contact=field(message, "time_to_contact", np.float64, (count,)) if n_timed else np.full(count, np.nan),
        inside=field(message, "inside", np.uint8, (count,)) if n_timed else np.zeros(count, np.uint8),
        nearest=int(message.nearest) if message.nearest < count else None,
        thickness=_thickness_of(message),
    )


def _thickness_of(message: DistanceArray) -> dict[str, float]:
    try:
        return dict(result_fields.read_thickness(message))
    except ValueError as error:
        raise ValueError(f"message: {error}") from None
