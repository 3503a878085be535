# SPDX-License-Identifier: Apache-2.0
"""Shapes at rest of meshes without a mesh file: those of the first frame with their triangles. No ROS."""

from dataclasses import dataclass

import numpy as np

from hpccd_ros.frames.types import SceneFrame, Topology


@dataclass(frozen=True, eq=False)
class _Shape:
    topology: Topology
    vertices: np.ndarray
    stamp: int


class RestShapes:
    """Keeps the shape of each mesh in ``numbers`` that has none in its topology until its triangles change. Detectors
    that share one have the same filters."""

    def __init__(self, numbers: tuple[int, ...]) -> None:
        self._numbers = numbers
        self._shapes: dict[int, _Shape] = {}

    def look_at(self, frame: SceneFrame) -> bool:
        """Take from ``frame`` the shapes that are unknown; whether there were some."""
        taken = False
        for number in self._numbers:
            topology, known = frame.topologies[number], self._shapes.get(number)
            if topology.rest is None and (known is None or not known.topology.same_content(topology)):
                self._shapes[number] = _Shape(topology, frame.vertices[number], frame.stamp)
                taken = True
        return taken

    def forget(self) -> None:
        """The next frame is the first one."""
        self._shapes.clear()

    def of(self, topologies: tuple[Topology, ...]) -> list[np.ndarray | None]:
        """The shape of each mesh, None where its topology has one or none is needed."""
        kept = (self._kept(number, topology) for number, topology in enumerate(topologies))
        return [None if shape is None else shape.vertices for shape in kept]

    def stamps(self, topologies: tuple[Topology, ...]) -> tuple[int, ...]:
        """The stamp of the frame of each shape, -1 where `of` has none; empty if all are -1."""
        kept = [self._kept(number, topology) for number, topology in enumerate(topologies)]
        stamps = tuple(-1 if shape is None else shape.stamp for shape in kept)
        return stamps if max(stamps, default=-1) >= 0 else ()

    def _kept(self, number: int, topology: Topology) -> _Shape | None:
        return self._shapes.get(number) if topology.rest is None else None
