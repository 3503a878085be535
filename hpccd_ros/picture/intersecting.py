# SPDX-License-Identifier: Apache-2.0
"""Faces that intersect another mesh: they are drawn in a colour of their own, as without it a body that pokes through
a cloth looks like flecks."""

from collections.abc import Sequence

import numpy as np

import hpccd_core as hc
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.frames.types import Topology


class IntersectingFaces:
    """In the states of one scene. Pairs that the scene ignores count as apart."""

    def __init__(self, builder: SceneBuilder) -> None:
        self._builder = builder.between_meshes
        self._topologies: tuple[Topology, ...] = ()
        self._detector: hc.Detector | None = None
        self._hits: hc.Intersections | None = None

    @property
    def contours(self) -> list[hc.Contour]:
        """The curves along which meshes intersected in the last call of `of`."""
        return [] if self._hits is None else self._hits.contours()

    def of(self, topologies: tuple[Topology, ...], vertices: Sequence[np.ndarray]) -> list[np.ndarray]:
        """(F,) bool for each mesh: faces that an edge of another mesh intersects, or whose edge intersects one."""
        if self._detector is None or topologies != self._topologies:
            scene = self._builder.build(topologies)
            self._topologies, self._detector = topologies, hc.Detector(scene, outputs=("points",))
        hits = self._detector.intersections(np.concatenate([np.asarray(v, np.float64) for v in vertices]))
        found, self._hits = hits.ef, hits
        firsts = np.cumsum([0, *(topology.n_vertices for topology in topologies)])
        faces = np.concatenate([t.faces.astype(np.int64) + first for t, first in zip(topologies, firsts, strict=False)])
        marked = np.zeros(len(faces), bool)
        marked[found[:, 2]] = True
        crossing = np.unique(_keys(found[:, :2], firsts[-1]))
        for a, b in ((0, 1), (1, 2), (2, 0)):
            marked |= np.isin(_keys(faces[:, [a, b]], firsts[-1]), crossing)
        return np.split(marked, np.cumsum([len(topology.faces) for topology in topologies])[:-1])


def _keys(edges: np.ndarray, n_vertices: int) -> np.ndarray:
    """(N,) one number for each edge (N,2), whichever of its ends is first."""
    edges = edges.astype(np.int64)
    return edges.min(axis=1) * n_vertices + edges.max(axis=1)
