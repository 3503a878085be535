# SPDX-License-Identifier: Apache-2.0
"""Several states of meshes side by side, with the curves along which they intersect."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

import hpccd_core as hc
from hpccd_ros.base.whole_file import whole_file
from hpccd_ros.picture.camera import Camera
from hpccd_ros.picture.contacts import BACKGROUND, INK, INTERSECTING, SUPERSAMPLING, as_bytes, render

CURVES = "#ff5f45"


@dataclasses.dataclass
class Panel:
    """meshes: name, vertices, faces, and edges beside theirs. intersecting: (F,) which of all faces intersect another
    mesh; None: not known."""

    title: str
    meshes: list[tuple[str, np.ndarray, np.ndarray, np.ndarray]]
    intersecting: np.ndarray | None = None
    contours: Sequence[hc.Contour] = ()


def save(
    panels: Sequence[Panel], path: str | Path, azimuth: float = -60.0, elevation: float = 26.0, width: int = 640
) -> None:
    """Write panels to one picture, at most three in a row, each `width` pixels wide.

    azimuth, elevation: degrees, where the camera stands. Each panel is framed on its own.
    """
    columns = min(3, len(panels))
    rows = -(-len(panels) // columns)
    size = (width, width * 3 // 4)
    figure = Figure(figsize=(columns * size[0] / 100, rows * (size[1] + 40) / 100), dpi=100, facecolor=BACKGROUND)
    FigureCanvasAgg(figure)
    for number, panel in enumerate(panels):
        image, camera, depth = render(panel.meshes, size, azimuth, elevation, intersecting=panel.intersecting)
        axes = figure.add_subplot(rows, columns, number + 1)
        axes.imshow(image, extent=(0, size[0], size[1], 0))
        axes.set_axis_off()
        axes.set_title(panel.title, color=INK, fontsize=10)
        draw_curves(axes, panel.contours, camera, depth)
        if panel.intersecting is not None and panel.intersecting.any():
            what = "bright green: faces that intersect another mesh"
            axes.text(0.5, -0.01, what, transform=axes.transAxes, ha="center", va="top", color=INTERSECTING, fontsize=8)
    figure.tight_layout()
    with whole_file(path, overwrite=True) as draft:
        draft.write_bytes(as_bytes(figure, draft.suffix, facecolor=BACKGROUND))


def draw_curves(axes: Axes, contours: Sequence[hc.Contour], camera: Camera, depth: np.ndarray) -> None:
    """Draw intersection curves over a rendered image; faint where they are behind a surface."""
    ends = [np.concatenate([c.points, c.points[:1]]) if c.closed else c.points for c in contours if len(c) > 1]
    if not ends:
        return
    segments = np.concatenate([np.stack([points[:-1], points[1:]], axis=1) for points in ends])
    seen = camera.project(segments.reshape(-1, 3)).reshape(-1, 2, 3)
    middle = seen.mean(axis=1)
    column = np.clip(middle[:, 0].astype(int), 0, depth.shape[1] - 1)
    row = np.clip(middle[:, 1].astype(int), 0, depth.shape[0] - 1)
    hidden = middle[:, 2] > depth[row, column] + 0.01 * np.ptp(depth[np.isfinite(depth)])
    for which, alpha in ((hidden, 0.45), (~hidden, 1.0)):
        lines = seen[which, :, :2] / SUPERSAMPLING
        axes.add_collection(LineCollection(lines, colors=CURVES, linewidths=1.6, alpha=alpha, capstyle="round"))
