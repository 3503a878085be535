# SPDX-License-Identifier: Apache-2.0
"""Pictures of the frames of a generated scene, side by side."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hpccd_ros.base.whole_file import whole_file
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
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from hpccd_ros.picture.contacts import BACKGROUND, INK, INTERSECTING, as_bytes, render

    columns = min(3, len(indices))
    rows = -(-len(indices) // columns)
    size = (width, width * 3 // 4)
    figure = Figure(figsize=(columns * size[0] / 100, rows * (size[1] + 40) / 100), dpi=100, facecolor=BACKGROUND)
    FigureCanvasAgg(figure)
    for panel, index in enumerate(indices):
        frame = scene.frame(index)
        parts, marked = _parts(scene, frame)
        image, _, _ = render(parts, size, azimuth, elevation, intersecting=marked)
        axes = figure.add_subplot(rows, columns, panel + 1)
        axes.imshow(image)
        axes.set_axis_off()
        axes.set_title(
            f"{scene.name}, frame {index}: {sum(map(len, scene.faces(index))):,} triangles", color=INK, fontsize=10
        )
        if marked.any():
            what = "bright green: faces that intersect another mesh"
            axes.text(0.5, -0.01, what, transform=axes.transAxes, ha="center", va="top", color=INTERSECTING, fontsize=8)
    figure.tight_layout()
    with whole_file(path, overwrite=True) as draft:
        draft.write_bytes(as_bytes(figure, draft.suffix, facecolor=BACKGROUND))


def _parts(scene, frame):
    """[(name, vertices, faces, edges)] of a frame, of robots the visual geometry; and which of all faces intersect
    another mesh."""
    topologies = [
        Topology(0, len(vertices), faces) for vertices, faces in zip(frame, scene.faces(frame.index), strict=True)
    ]
    settings = tuple(MeshSettings(mesh.name, static=mesh.static) for mesh in scene.meshes)
    marked = IntersectingFaces(SceneBuilder(settings, scene.ignored_pairs)).of(tuple(topologies), frame)
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
    return parts, np.concatenate(flags)
