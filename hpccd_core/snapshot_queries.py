# SPDX-License-Identifier: Apache-2.0
"""Queries of one snapshot, a part of Detector."""

from __future__ import annotations

import functools
from typing import Generic, NoReturn, cast

from . import arguments, device_results
from .array_types import Positions, Stream
from .core_calls import SnapshotCalls
from .mesh_layout import Indices
from .options import Results
from .proximity import Gap, Intersections, Proximity
from .result_types import DistancesResult, IntersectionsResult, ProximityResult
from .results import INTERSECTION_ARRAYS, result_of, with_outputs

_ONE_FRAME = "the positions of one frame; for a motion call detect(vertices_t0, vertices_t1)"


class SnapshotQueries(SnapshotCalls, Generic[ProximityResult, IntersectionsResult, DistancesResult]):
    """Queries of positions at one time. Coordinates may be as large as 1e300."""

    results: Results
    _outputs: tuple[str, ...]

    @arguments.hide_unnamed
    def proximity(
        self, vertices: Positions, distance: float, *unnamed: NoReturn, stream: Stream = None
    ) -> ProximityResult:
        """All vertex-face and edge-edge pairs within a distance of each other.

        Parameters
        ----------
        vertices : Positions, shape (V, 3)
        distance : float
            Euclidean, in the unit of the coordinates; 0 reports contact. Neighbours within a mesh are reported
            too if they are this close: only features that share a vertex are left out.
        stream : Stream, optional

        Returns
        -------
        Proximity or DeviceProximity
            "exact" and "conservative": exactly the pairs of rational arithmetic; distances within 1e-12 of the
            scene's size.
        """
        if unnamed:
            arguments.reject_unnamed("proximity", "the positions of one frame, and a distance")
        distance = arguments.length("distance", distance)
        found = self._ask("proximity", vertices, stream, distance)
        on_device = self.results == "device"
        if on_device:
            return cast(ProximityResult, device_results.proximity_of(found, self._outputs, self._layout))
        return cast(ProximityResult, result_of(Proximity, with_outputs(found, self._outputs), self._layout))

    @arguments.hide_unnamed
    def intersections(self, vertices: Positions, *unnamed: NoReturn, stream: Stream = None) -> IntersectionsResult:
        """All edges that intersect or touch a face with which they share no vertex, coplanar ones included.

        Parameters
        ----------
        vertices : Positions, shape (V, 3)
        stream : Stream, optional

        Returns
        -------
        Intersections or DeviceIntersections
            Decided as by rational arithmetic, at every accuracy. With outputs=("points",) it has intersection curves.
        """
        if unnamed:
            arguments.reject_unnamed("intersections", _ONE_FRAME)
        found = self._ask("intersections", vertices, stream)
        on_device = self.results == "device"
        if on_device:
            return cast(IntersectionsResult, device_results.intersections_of(found, self._layout))
        found = with_outputs(found, self._outputs, INTERSECTION_ARRAYS)
        if "points" in self._outputs:
            found["faces"] = self._faces
        return cast(IntersectionsResult, result_of(Intersections, found, self._layout))

    @arguments.hide_unnamed
    def distances(self, vertices: Positions, *unnamed: NoReturn, stream: Stream = None) -> DistancesResult:
        """The smallest distance of each two meshes that the scene enables, within a mesh too, and which lies inside.

        Parameters
        ----------
        vertices : Positions, shape (V, 3)
        stream : Stream, optional

        Returns
        -------
        list of Gap, or list of W such lists with worlds
            A Gap for each pair, in the order in which the meshes were added: (0, 0), (0, 1), ...

        Notes
        -----
        Of several nearest pairs whose distances are the same double, the first in canonical order is returned. Which
        of two pairs at the same exact distance is rounded to the smaller double is unspecified, but the same on every
        machine.
        """
        if unnamed:
            arguments.reject_unnamed("distances", _ONE_FRAME)
        names = self._layout.mesh_names
        gaps = [
            Gap(names[a], names[b], distance, kind, tuple(features), *others)
            for a, b, distance, kind, features, *others in self._ask("distances", vertices, stream)
        ]
        if self.worlds is None:
            return cast(DistancesResult, gaps)
        n = len(gaps) // self.worlds
        return cast(DistancesResult, [gaps[k * n : (k + 1) * n] for k in range(self.worlds)])

    @functools.cached_property
    def _faces(self) -> Indices:
        faces: Indices = self._core.faces()
        faces.flags.writeable = False  # all results share it
        return faces
