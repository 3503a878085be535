# SPDX-License-Identifier: Apache-2.0
"""Pictures of the frames of a generated scene, side by side."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.frames.types import NO_EDGES, MeshSettings, Topology
from hpccd_ros.picture.intersecting import IntersectingFaces
from hpccd_ros.scenes.scene import Scene


def save(
    scene: Scene,
    indices: Sequence[int],
    path: str | Path,
    azimuth: float = -60.0,
    elevation: float = 26.0,
    width: int = 640,
) -> None:
    """Write frames `indices` of a scene to one picture, at most three in a row, each `width` pixels wide.

    azimuth, elevation: degrees, where the camera stands. Each frame is framed on its own.
    """
    from hpccd_core.picture import panels

    drawn = []
    for index in indices:
        title = f"{scene.name}, frame {index}: {sum(map(len, scene.faces(index))):,} triangles"
        drawn.append(panels.Panel(title, *_parts(scene, scene.frame(index))))
    panels.save(drawn, path, azimuth, elevation, width)


def _parts(scene, frame):
    """[(name, vertices, faces, edges)] of a frame, of robots the visual geometry; which of all faces intersect another
    mesh; and the curves along which they do."""
    topologies = [
        Topology(0, len(vertices), faces) for vertices, faces in zip(frame, scene.faces(frame.index), strict=True)
    ]
    settings = tuple(MeshSettings(mesh.name, static=mesh.static) for mesh in scene.meshes)
    intersecting = IntersectingFaces(SceneBuilder(settings, scene.ignored_pairs))
    marked = intersecting.of(tuple(topologies), frame)
    links = {mesh.name for robot in scene.robots for mesh in robot.meshes}
    parts, flags = [], []
    for name, vertices, topology, of_mesh in zip(scene.mesh_names, frame, topologies, marked, strict=True):
        if name not in links:
            parts.append((name, vertices, topology.faces, NO_EDGES))
            flags.append(of_mesh)
    for robot in scene.robots:
        seen = dataclasses.replace(robot, geometry="visual")
        for mesh, vertices in zip(seen.meshes, seen.vertices(frame.time), strict=True):
            parts.append((mesh.name, vertices, mesh.faces, NO_EDGES))
            flags.append(np.zeros(len(mesh.faces), bool))
    curves = [c for c in intersecting.contours if c.mesh_a not in links and c.mesh_b not in links]
    return parts, np.concatenate(flags), curves
