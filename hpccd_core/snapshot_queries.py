# SPDX-License-Identifier: Apache-2.0
"""Queries of one snapshot, a part of Detector."""

from __future__ import annotations

import functools
from typing import Generic, NoReturn, cast

import numpy as np
from numpy.typing import NDArray

from . import arguments, device_distances, device_results
from .array_types import ArrayLike, Positions, Stream
from .core_calls import SnapshotCalls
from .mesh_layout import Indices
from .options import Results
from .proximity import Gap, Intersections, Proximity
from .result_types import DistancesResult, IntersectionsResult, ProximityResult
from .results import INTERSECTION_ARRAYS, result_of, with_outputs

_NOT_GIVEN = float("nan")  # an object of its own: math.nan may be given, and is invalid
_ONE_FRAME = "the positions of one frame; for a motion call detect(vertices_t0, vertices_t1)"


class SnapshotQueries(SnapshotCalls, Generic[ProximityResult, IntersectionsResult, DistancesResult]):
    """Queries of positions at one time. Coordinates may be as large as 1e300."""

    results: Results
    _outputs: tuple[str, ...]

    @arguments.hide_unnamed
    def proximity(
        self,
        vertices: Positions | None = None,
        distance: float = _NOT_GIVEN,
        *unnamed: NoReturn,
        poses: ArrayLike | None = None,
        stream: Stream = None,
    ) -> ProximityResult:
        """All vertex-face and edge-edge pairs within a distance of each other.

        Parameters
        ----------
        vertices : Positions, shape (V, 3)
            With `poses`: see :meth:`distances`.
        distance : float
            Euclidean, in the unit of the coordinates; 0 reports contact. Neighbours within a mesh are reported
            too if they are this close: only features that share a vertex are left out.
        poses : ArrayLike, shape (K, 7), optional
            See :meth:`distances`.
        stream : Stream, optional

        Returns
        -------
        Proximity or DeviceProximity
            "exact" and "conservative": exactly the pairs of rational arithmetic; distances within 1e-12 of the
            scene's size.
        """
        if unnamed:
            arguments.reject_unnamed("proximity", "the positions of one frame, and a distance")
        if distance is _NOT_GIVEN:
            raise TypeError("proximity: takes the positions of one frame, and a distance; distance is missing")
        distance = arguments.length("distance", distance)
        found = self._ask("proximity", vertices, stream, distance, poses=poses)
        on_device = self.results == "device"
        if on_device:
            return cast(ProximityResult, device_results.proximity_of(found, self._outputs, self._layout))
        return cast(ProximityResult, result_of(Proximity, with_outputs(found, self._outputs), self._layout))

    @arguments.hide_unnamed
    def intersections(
        self,
        vertices: Positions | None = None,
        *unnamed: NoReturn,
        poses: ArrayLike | None = None,
        stream: Stream = None,
    ) -> IntersectionsResult:
        """All edges that intersect or touch a face with which they share no vertex, coplanar ones included.

        Parameters
        ----------
        vertices : Positions, shape (V, 3)
            With `poses`: see :meth:`distances`.
        poses : ArrayLike, shape (K, 7), optional
            See :meth:`distances`.
        stream : Stream, optional

        Returns
        -------
        Intersections or DeviceIntersections
            Decided as by rational arithmetic, at every accuracy. With outputs=("points",) it has intersection curves.
        """
        if unnamed:
            arguments.reject_unnamed("intersections", _ONE_FRAME)
        found = self._ask("intersections", vertices, stream, poses=poses)
        on_device = self.results == "device"
        if on_device:
            return cast(IntersectionsResult, device_results.intersections_of(found, self._layout))
        found = with_outputs(found, self._outputs, INTERSECTION_ARRAYS)
        if "points" in self._outputs:
            found["faces"] = self._faces
        return cast(IntersectionsResult, result_of(Intersections, found, self._layout))

    @arguments.hide_unnamed
    def distances(
        self,
        vertices: Positions | None = None,
        *unnamed: NoReturn,
        poses: ArrayLike | None = None,
        stream: Stream = None,
    ) -> DistancesResult:
        """The smallest distance of each two meshes that the scene enables, within a mesh too, and which lies inside.

        Parameters
        ----------
        vertices : Positions, shape (V, 3)
            With `poses`: (U, 3), the positions of the meshes without a shape only, in the order added; left out where
            every mesh has one.
        poses : ArrayLike, shape (K, 7), optional
            For each mesh that was added with a shape and is not static, in the order added: position x y z, then the
            quaternion x y z w of a rotation, of length 1. With worlds (W, K, 7). Without `vertices` and `poses`, all
            shapes are where they were given.
        stream : Stream, optional

        Returns
        -------
        list of Gap, list of W such lists with worlds, or DeviceDistances
            A Gap, or a row, for each pair, in the order in which the meshes were added: (0, 0), (0, 1), ...

        Notes
        -----
        Of several nearest pairs whose distances are the same double, the first in canonical order is returned. Which
        of two pairs at the same exact distance is rounded to the smaller double is unspecified, but the same on every
        machine.

        Results by poses are bit-identical to those of the positions that :meth:`positions_at` returns, and much faster
        if every mesh has a shape: only what the search needs is computed. With ``backend="gpu"`` the GPU does so.

        Examples
        --------
        >>> import hpccd_core as hc
        >>> vertices, faces = hc.shapes.icosphere(2)
        >>> scene = hc.Scene()
        >>> _ = scene.add_mesh("fixed", faces, shape=vertices, static=True, self_collision=False)
        >>> _ = scene.add_mesh("moved", faces, shape=vertices, self_collision=False)
        >>> detector = hc.Detector(scene)
        >>> gap, = detector.distances(poses=[[3, 0, 0, 0, 0, 0, 1]])
        >>> round(gap.distance, 6)
        1.0
        """
        if unnamed:
            arguments.reject_unnamed("distances", _ONE_FRAME)
        names = self._layout.mesh_names
        if self.results == "device":
            found = self._ask("distance_arrays", vertices, stream, poses=poses)
            return cast(DistancesResult, device_distances.distances_of(found, self.worlds, names))
        gaps = [
            Gap(names[a], names[b], distance, kind, tuple(features), *others)
            for a, b, distance, kind, features, *others in self._ask("distances", vertices, stream, poses=poses)
        ]
        if self.worlds is None:
            return cast(DistancesResult, gaps)
        n = len(gaps) // self.worlds
        return cast(DistancesResult, [gaps[k * n : (k + 1) * n] for k in range(self.worlds)])

    def positions_at(self, poses: ArrayLike | None = None, *, vertices: Positions | None = None) -> NDArray[np.float64]:
        """The positions of all vertices at poses, as queries by poses use them.

        Parameters
        ----------
        poses, vertices : ArrayLike, optional
            As in :meth:`distances`.

        Returns
        -------
        ndarray, shape (V, 3), float64
            With worlds (W, V, 3).
        """
        found: NDArray[np.float64] = self._ask_at("positions", vertices, poses)
        return found.reshape(self._shape)

    @functools.cached_property
    def _faces(self) -> Indices:
        faces: Indices = self._core.faces()
        faces.flags.writeable = False  # all results share it
        return faces
