# SPDX-License-Identifier: Apache-2.0
"""Faces that intersect another mesh: they are drawn in a colour of their own, as without it a body that pokes through
a cloth looks like flecks. And the curves along which meshes intersect, and how deep."""

from collections.abc import Sequence

import numpy as np

import hpccd_core as hc
from hpccd_core.picture import intersecting_faces
from hpccd_core.picture.lines import Depth
from hpccd_ros.detect.interpenetration import InterpenetrationDetector
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.frames.types import Topology


class IntersectingFaces:
    """In the states of one scene. Pairs that the scene ignores count as apart.

    ``contours``, ``depths``: the curves along which meshes intersected in the last call of `of`, and the translations
    that separate them. depth: whether these are searched, which may take a second for each pair.
    """

    def __init__(self, builder: SceneBuilder, *, depth: bool = False) -> None:
        self._detector = InterpenetrationDetector(builder)
        self._depth = depth
        self.contours: list[hc.Contour] = []
        self.depths: list[Depth] = []

    def of(
        self,
        topologies: tuple[Topology, ...],
        vertices: Sequence[np.ndarray],
        rest: Sequence[np.ndarray | None] = (),
    ) -> list[np.ndarray]:
        """(F,) bool for each mesh: faces that an edge of another mesh intersects, or whose edge intersects one. rest:
        the shapes at rest that the topologies lack."""
        hits = self._detector.intersections(topologies, vertices, rest)
        self.contours = hits.contours()
        self.depths = self._detector.depths(topologies, vertices, hits) if self._depth else []
        firsts = np.cumsum([0, *(topology.n_vertices for topology in topologies)])
        faces = np.concatenate([t.faces.astype(np.int64) + first for t, first in zip(topologies, firsts, strict=False)])
        marked = intersecting_faces.marked(hits, faces, int(firsts[-1]))
        return np.split(marked, np.cumsum([len(topology.faces) for topology in topologies])[:-1])
