# SPDX-License-Identifier: Apache-2.0
"""Where the meshes of a frame intersect, and the translations that separate those that do. No ROS."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import zip_longest

import numpy as np

import hpccd_core as hc
from hpccd_core.picture.lines import Depth
from hpccd_ros.detect.closed_meshes import ClosedMeshes
from hpccd_ros.detect.core import Cancellation
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.frames.types import Topology


class InterpenetrationDetector:
    """Keeps scenes and detectors from frame to frame while topologies stay the same. All features are tested.

    threads: of the core; 0: all. cancellation: its ``cancel`` makes the calls raise hc.Cancelled.
    """

    def __init__(self, builder: SceneBuilder, *, threads: int = 0, cancellation: Cancellation | None = None) -> None:
        self._numbers = {mesh.name: number for number, mesh in enumerate(builder.meshes)}
        between_meshes = (pair for pair in builder.ignored_pairs if set(pair) <= self._numbers.keys())
        self._builder = SceneBuilder(builder.meshes, tuple(between_meshes))  # planes intersect nothing
        self._options = {"outputs": ("points",), "backend": "cpu", "threads": threads}
        self._cancellation = cancellation or Cancellation()
        named = [(self._numbers[a], self._numbers[b]) for a, b in self._builder.pairs]
        self._pairs = np.array(named, np.int64).reshape(-1, 2)  # the lower number first
        self._topologies: tuple[Topology, ...] = ()
        self._rest: list[np.ndarray | None] = []
        self._closed_meshes = ClosedMeshes()
        self._closed: np.ndarray | None = None
        self._surfaces: hc.Detector | None = None  # within meshes, too
        self._solids: hc.Detector | None = None  # made for the first depth

    def intersections(
        self,
        topologies: tuple[Topology, ...],
        vertices: Sequence[np.ndarray],
        rest: Sequence[np.ndarray | None] = (),
    ) -> hc.Intersections:
        """The edges that intersect faces, with points. vertices: of each mesh. rest: as `SceneBuilder.build` takes it;
        a mesh without a shape at rest is tested as if it had no ``ignored_at_rest``. Raises the core's errors."""
        self._prepare(topologies, rest)
        return self._surfaces.intersections(_concatenated(vertices))

    def depths(
        self, topologies: tuple[Topology, ...], vertices: Sequence[np.ndarray], hits: hc.Intersections
    ) -> list[Depth]:
        """Of the pairs of different meshes that intersect in ``hits``, or of which one is inside the other, closed one.
        Where mesh a is static, mesh b moves instead. hits: the last result of `intersections`. Raises the core's
        errors."""
        x = _concatenated(vertices)
        solid = [number for number, topology in enumerate(topologies) if len(topology.faces)]
        a, b = (np.asarray(side, np.int64) for side in (hits.mesh_a, hits.mesh_b))
        meeting = {tuple(sorted(pair)) for pair in np.unique(np.stack([a, b], axis=1), axis=0).tolist()}
        pairs = sorted(pair for pair in meeting if pair[0] != pair[1] and set(pair) <= set(solid))
        if self._may_contain(vertices, meeting):
            self._prepare_solids()
            gaps = [gap for gap in self._solids.distances(x) if gap.inside]
            pairs += [(self._numbers[gap.mesh_a], self._numbers[gap.mesh_b]) for gap in gaps]
        found = (self._depth(x, vertices, hits, pair) for pair in pairs)
        return [depth for depth in found if depth.length > 0]

    def _prepare(self, topologies: tuple[Topology, ...], rest: Sequence[np.ndarray | None]) -> None:
        shapes = [t.rest if t.rest is not None else r for t, r in zip_longest(topologies, rest)]
        same = all(a is b for a, b in zip_longest(shapes, self._rest))
        if self._surfaces is None or topologies != self._topologies or not same:
            meshes = tuple(
                mesh if shape is not None else replace(mesh, ignored_at_rest=None)
                for mesh, shape in zip(self._builder.meshes, shapes, strict=True)
            )
            scene = replace(self._builder, meshes=meshes).build(topologies, shapes)
            self._surfaces = self._cancellation.guard(hc.Detector(scene, **self._options))
            self._topologies, self._rest, self._solids, self._closed = topologies, shapes, None, None

    def _prepare_solids(self) -> None:
        if self._solids is None:
            scene = self._builder.between_meshes.build(self._topologies)
            self._solids = hc.Detector(scene, **self._options)
            self._cancellation.guard(self._surfaces, self._solids)

    def _may_contain(self, vertices: Sequence[np.ndarray], meeting: set[tuple[int, ...]]) -> bool:
        """Whether the boxes of two meshes overlap of which one is closed, and which do not intersect."""
        if self._closed is None:
            self._closed = np.array(self._closed_meshes.of(self._topologies))
        low, high = np.full((2, len(vertices), 3), np.nan)  # of no vertices: overlaps nothing
        for number, of_mesh in enumerate(vertices):
            if len(of_mesh):
                low[number], high[number] = np.min(of_mesh, axis=0), np.max(of_mesh, axis=0)
        a, b = self._pairs.T
        overlap = ((low[a] <= high[b]) & (low[b] <= high[a])).all(axis=1) & (self._closed[a] | self._closed[b])
        return any(pair not in meeting for pair in map(tuple, self._pairs[overlap].tolist()))

    def _depth(self, x: np.ndarray, vertices, hits: hc.Intersections, pair: tuple[int, int]) -> Depth:
        meshes = self._builder.meshes
        a, b = reversed(pair) if meshes[pair[0]].static else pair
        self._prepare_solids()
        found = self._solids.penetration(x, a, b)
        first = sum(len(v) for v in vertices[:a])
        start = _touching(x, hits.faces, found, range(first, first + len(vertices[a])))
        if start is None:
            of_pair = (np.sort(np.stack([hits.mesh_a, hits.mesh_b], axis=1), axis=1) == sorted(pair)).all(axis=1)
            around = hits.points[of_pair] if of_pair.any() else np.asarray(vertices[a], np.float64)
            start = 0.5 * around.min(axis=0) + 0.5 * around.max(axis=0)
        return Depth(meshes[a].name, meshes[b].name, start, found.translation)


def _concatenated(vertices: Sequence[np.ndarray]) -> np.ndarray:
    return np.concatenate([np.asarray(v, np.float64) for v in vertices])


def _touching(x: np.ndarray, faces: np.ndarray, found: hc.Penetration, of_a: range) -> np.ndarray | None:
    """The point of mesh a that touches mesh b after the translation, before it; None without features."""
    if found.kind == "vertex-face":
        vertex, _ = found.features
        return x[vertex] if vertex in of_a else x[vertex] - found.translation
    if found.kind == "edge-edge":
        a0, a1, b0, b1 = x[list(found.features)]
        # The nearest points of two lines that meet, but for rounding; the clip is for nearly parallel edges.
        along = np.stack([a1 - a0, b0 - b1], axis=1)
        s = np.linalg.lstsq(along, b0 - a0 - found.translation, rcond=None)[0][0]
        return a0 + np.clip(s, 0.0, 1.0) * (a1 - a0)
    return None
