# SPDX-License-Identifier: Apache-2.0
"""Robots are drawn by the visual geometry of their description, where it has some: collision geometry has gaps."""

from collections.abc import Mapping, Sequence

import numpy as np

from hpccd_ros.frames.types import SceneFrame, Topology
from hpccd_ros.robots.placement import LinkPlacement
from hpccd_ros.robots.robot import Robot


class VisualGeometry:
    """robots: made of their visual geometry, by name."""

    def __init__(self, robots: Mapping[str, Robot]) -> None:
        self._meshes = {mesh.name: (robot, mesh) for robot, of in robots.items() for mesh in of.meshes}

        #: Topology of each link ROBOT/LINK that has visual geometry.
        self.topologies: dict[str, Topology] = {name: mesh.topology for name, (_, mesh) in self._meshes.items()}

    def vertices(self, names: Sequence[str], frame: SceneFrame) -> dict[str, np.ndarray]:
        """(V,3) of each of these links whose pose is known. names: of the meshes of the frame."""
        placed, states = {}, {}
        for name, placement in zip(names, frame.placements, strict=False):
            if placement is not None:
                placed[name] = placement.pose
            if isinstance(placement, LinkPlacement):
                states[name.partition("/")[0]] = placement.state
        found = {}
        for name, (robot, mesh) in self._meshes.items():
            # A link without collision geometry is no mesh of the frame.
            pose = placed.get(name) or (states[robot].poses.get(mesh.link) if robot in states else None)
            if pose is not None:
                found[name] = pose.apply(mesh.vertices)
        return found


NO_VISUAL = VisualGeometry({})
