# SPDX-License-Identifier: Apache-2.0
"""Queries of one snapshot about the inside of closed meshes, a part of Detector."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core, arguments, device_arrays
from .array_types import ArrayLike, MeshName, Positions, Stream
from .core_calls import SnapshotCalls
from .solids import Penetration, SignedDistances


class SolidQueries(SnapshotCalls):
    """Queries of meshes as solids at one time. Coordinates may be as large as 1e300; results are on the host."""

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
            As for :meth:`winding_numbers`.

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

    def separating_translation(
        self, vertices: Positions, mesh_a: MeshName, mesh_b: MeshName, direction: ArrayLike, *, stream: Stream = None
    ) -> float:
        """How far one mesh must move along a direction until it is free of another one.

        Parameters
        ----------
        vertices : Positions, shape (V, 3)
            One frame. Coordinates may be as large as 1e300.
        mesh_a, mesh_b : str or int
            Names or numbers of two different meshes with faces. Mesh a moves.
        direction : ArrayLike, shape (3,)
            Of any length above 0.
        stream : Stream, optional

        Returns
        -------
        float
            The infimum of the s >= 0 for which a, moved by s along `direction`, is free of b, in the unit of
            the coordinates: within 1e-12 of its own size, above or below. At s they touch; beyond, they may meet again.

        Raises
        ------
        TypeError, ValueError
            If an argument is invalid, if a mesh has no faces, or if the detector has worlds.

        Notes
        -----
        Free: no face of one has a point in common with a face of the other, and no part of a mesh is inside the other
        one where that is closed. Decided as by rational arithmetic, on the CPU. The rules of the scene do not apply.

        Examples
        --------
        >>> import hpccd_core as hc
        >>> vertices, faces = hc.shapes.box()
        >>> scene = hc.Scene()
        >>> for name in ("a", "b"):
        ...     _ = scene.add_mesh(name, faces)
        >>> detector = hc.Detector(scene)
        >>> positions = {"a": vertices, "b": vertices + [0.25, 0, 0]}
        >>> detector.separating_translation(positions, "a", "b", (-1, 0, 0))
        0.75
        """
        along = arguments.vector("direction", direction)
        s: float = self._ask("separating_translation", vertices, stream, *self._pair(mesh_a, mesh_b), along)
        return s

    def penetration(
        self,
        vertices: Positions,
        mesh_a: MeshName,
        mesh_b: MeshName,
        *,
        start: ArrayLike | None = None,
        stream: Stream = None,
    ) -> Penetration:
        """A short translation of mesh a that frees it of mesh b, and a lower bound of all such translations.

        Parameters
        ----------
        vertices : Positions, shape (V, 3)
            One frame.
        mesh_a, mesh_b : str or int
            Names or numbers of two different meshes with faces.
        start : ArrayLike, shape (3,), optional
            A translation near which to search, such as that of the previous frame, instead of in all directions: that
            is faster, but stays on one side, so the result may be several times as long.
        stream : Stream, optional

        Returns
        -------
        Penetration
            Free as in :meth:`separating_translation`, proven for vertices_a + translation in float64. For convex
            meshes mostly within 1e-6 of the shortest, otherwise the shortest that was found.

        Raises
        ------
        TypeError, ValueError
            If an argument is invalid, if a mesh has no faces, or if the detector has worlds.

        Notes
        -----
        Local searches follow the contacts (Je et al., "PolyDepth", ACM Transactions on Graphics, 2012) from normals of
        hulls, intersection curves and deepest vertex, and principal axes. Without `start`, mostly no longer than along
        an axis (always below 2,000 faces). Depends on the arguments only. The rules of the scene do not apply.

        Examples
        --------
        >>> import hpccd_core as hc
        >>> vertices, faces = hc.shapes.box()
        >>> scene = hc.Scene()
        >>> for name in ("a", "b"):
        ...     _ = scene.add_mesh(name, faces)
        >>> p = hc.Detector(scene).penetration({"a": vertices, "b": vertices + [0.25, 0.125, 0.5]}, "a", "b")
        >>> round(p.depth, 9), p.translation.round(9).tolist()
        (0.5, [0.0, 0.0, -0.5])
        """
        place = None if start is None else arguments.vector("start", start)
        found = self._ask("penetration", vertices, stream, *self._pair(mesh_a, mesh_b), place)
        translation, depth, lower_bound, kind, features = found
        return Penetration(translation, depth, lower_bound, kind, tuple(features))

    def _pair(self, mesh_a: MeshName, mesh_b: MeshName) -> tuple[int, int]:
        numbers = self._mesh_numbers
        return arguments.mesh_number("mesh_a", mesh_a, numbers), arguments.mesh_number("mesh_b", mesh_b, numbers)

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
