# SPDX-License-Identifier: Apache-2.0
"""Queries of one snapshot about the inside of closed meshes, a part of Detector."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core, arguments, device_arrays
from .array_types import MeshName, Positions, Stream
from .core_calls import SnapshotCalls
from .solids import SignedDistances


class SolidQueries(SnapshotCalls):
    """Queries of closed meshes at one time. Coordinates may be as large as 1e300; results are on the host."""

    _mesh_numbers: Mapping[str, int]

    @arguments.hide_unnamed
    def winding_numbers(
        self, vertices: Positions, points: Positions, mesh: MeshName, *, stream: Stream = None
    ) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
        """How often a closed mesh encloses each of many points, and which points are on its surface.

        Parameters
        ----------
        vertices : Positions, shape (V, 3)
            All meshes of the scene.
        points : Positions, shape (K, 3), or (W, K, 3) with worlds
        mesh : str or int
            Name or number of a closed mesh; it may intersect itself, and have several components.
        stream : Stream, optional

        Returns
        -------
        numbers : ndarray, shape (K,), int32, or (W, K) with worlds
            0 outside and on the surface, +1 inside a mesh whose faces are counterclockwise seen from outside; sums
            where parts of the mesh overlap.
        on_surface : ndarray, shape (K,), bool, or (W, K) with worlds
            Whether a face contains the point.

        Raises
        ------
        TypeError, ValueError
            Also if the mesh is not closed (:func:`closed`), with an edge that shows it.

        Notes
        -----
        Decided as by rational arithmetic, at every accuracy: by the faces that an axis-parallel ray crosses. Rays
        through vertices and edges are resolved by symbolic perturbation (Edelsbrunner and Muecke, "Simulation of
        simplicity", ACM Transactions on Graphics, 1990).

        Examples
        --------
        >>> import hpccd_core as hc
        >>> vertices, faces = hc.shapes.box((2, 2, 2))
        >>> scene = hc.Scene()
        >>> _ = scene.add_mesh("box", faces)
        >>> hc.Detector(scene).winding_numbers(vertices, [[0.0, 0, 0], [1, 0, 0], [2, 0, 0]], "box")
        (array([1, 0, 0], dtype=int32), array([False,  True, False]))
        """
        numbers, on_surface = self._ask_points("winding_numbers", vertices, points, mesh, stream)
        return self._by_world(numbers), self._by_world(on_surface)

    @arguments.hide_unnamed
    def signed_distances(
        self, vertices: Positions, points: Positions, mesh: MeshName, *, stream: Stream = None
    ) -> SignedDistances:
        """Distances of many points from a closed mesh: negative inside, with the nearest face and point.

        Parameters
        ----------
        vertices : Positions, shape (V, 3)
            All meshes of the scene.
        points : Positions, shape (K, 3), or (W, K, 3) with worlds
        mesh : str or int
            Name or number of a closed mesh.
        stream : Stream, optional

        Returns
        -------
        SignedDistances
            Signs are exact. Distances have errors of at most 1e-12 of the largest distance of the point from the mesh.

        Raises
        ------
        TypeError, ValueError
            As :meth:`winding_numbers`.

        Examples
        --------
        >>> import hpccd_core as hc
        >>> vertices, faces = hc.shapes.box((2, 2, 2))
        >>> scene = hc.Scene()
        >>> _ = scene.add_mesh("box", faces)
        >>> signed = hc.Detector(scene).signed_distances(vertices, [[0.0, 0, 0.75], [1, 0, 0], [3, 0, 0]], "box")
        >>> signed.distance, signed.closest[2]
        (array([-0.25,  0.  ,  2.  ]), array([1., 0., 0.]))
        """
        distance, faces, closest = self._ask_points("signed_distances", vertices, points, mesh, stream)
        return SignedDistances(self._by_world(distance), self._by_world(faces), self._by_world(closest))

    def _ask_points(self, query: str, vertices: object, points: object, mesh: MeshName, stream: object) -> Any:
        number = arguments.mesh_number("mesh", mesh, self._mesh_numbers)
        made_on = device_arrays.stream_number(stream)
        given: _core.Positions | NDArray[Any]
        if device_arrays.is_on_device(points):
            shape = arguments.shape_of_points("points", tuple(getattr(points, "shape", ())), self.worlds)
            rows = int(np.prod(shape[:-1]))
            given = device_arrays.positions("points", points, shape, made_on).for_core(rows)
        else:
            given = device_arrays.on_host(arguments.points("points", points, self.worlds), made_on)
        return self._ask(query, vertices, stream, given, number)

    def _by_world(self, rows: NDArray[Any]) -> NDArray[Any]:
        return rows if self.worlds is None else rows.reshape(self.worlds, -1, *rows.shape[1:])
