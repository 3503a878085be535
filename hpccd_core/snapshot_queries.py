# SPDX-License-Identifier: Apache-2.0
"""Queries of one snapshot, a part of Detector."""

from typing import Any, Generic, cast

from numpy.typing import ArrayLike

from . import _core, arguments, device_arrays, device_results
from .answers import OfNear, OfNearest, OfPierced
from .device_arrays import DeviceArrayLike
from .options import Results
from .proximity import Gap, Intersections, Proximity
from .worlds import answer_of


class SnapshotQueries(Generic[OfNear, OfPierced, OfNearest]):
    """What is near, pierced, or nearest at one time. Coordinates may be as large as 1e300."""

    worlds: int | None
    results: Results
    _shape: tuple[int, ...]  # of all positions
    _rows: int
    _core: _core.Detector
    _mesh_names: tuple[str, ...]

    def proximity(self, vertices: ArrayLike | DeviceArrayLike, distance: float, stream: object = None) -> OfNear:
        """All vertex-face and edge-edge pairs within a distance of each other, features that share a vertex apart.

        vertices: (V, 3), of W worlds (W, V, 3), float32 or float64, taken as by detect(), but up to 1e300. distance:
        Euclidean, between closed features, in units of the coordinates; 0 gives those that touch. "exact" and
        "conservative" report exactly the pairs that rational arithmetic would; "balanced" and "fast" promise it not,
        but are computed alike today; distances are within 1e-12 of the scene's size. Neighbours that share no vertex
        count like all others: with a distance beyond the shortest edge all of them are reported. stream: as for
        detect(). With results="device" the answer is a DeviceProximity.
        """
        distance = arguments.length("distance", distance)
        found = self._ask("proximity", vertices, stream, distance)
        on_device = self.results == "device"
        return cast(OfNear, device_results.proximity_of(found) if on_device else answer_of(Proximity, found))

    def intersections(self, vertices: ArrayLike | DeviceArrayLike, stream: object = None) -> OfPierced:
        """All edges that pierce or touch a face with which they share no vertex, coplanar ones included.

        vertices: (V, 3), of W worlds (W, V, 3), float32 or float64, taken as by detect(), but up to 1e300. Decided as
        rational arithmetic would, at every accuracy. stream: as for detect(). With results="device" the answer is a
        DeviceIntersections.
        """
        found = self._ask("intersections", vertices, stream)
        on_device = self.results == "device"
        return cast(OfPierced, device_results.intersections_of(found) if on_device else answer_of(Intersections, found))

    def distances(self, vertices: ArrayLike | DeviceArrayLike, stream: object = None) -> OfNearest:
        """The smallest distance of each pair of meshes that the scene enables, within a mesh too.

        vertices: (V, 3), of W worlds (W, V, 3), float32 or float64, taken as by detect(), but up to 1e300. One Gap for
        each pair, in the order in which the meshes were added: (0, 0), (0, 1), ... Of W worlds a list of W such lists.
        Found by branch and bound, without a list of pairs.
        """
        names = self._mesh_names
        gaps = [
            Gap(names[a], names[b], distance, kind, tuple(features), points)
            for a, b, distance, kind, features, points in self._ask("distances", vertices, stream)
        ]
        if self.worlds is None:
            return cast(OfNearest, gaps)
        n = len(gaps) // self.worlds
        return cast(OfNearest, [gaps[k * n : (k + 1) * n] for k in range(self.worlds)])

    def _ask(self, query: str, vertices: object, stream: object, *more: float) -> Any:
        made_on = device_arrays.stream_number(stream)
        ask = getattr(self._core, query)
        if device_arrays.is_on_device(vertices):
            place = device_arrays.positions("vertices", vertices, self._shape, made_on)
            return ask(place.for_core(self._rows), *more)
        there = arguments.vertices("vertices", vertices, self._shape)
        return ask(device_arrays.on_host(there, made_on), *more)
