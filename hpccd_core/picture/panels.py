# SPDX-License-Identifier: Apache-2.0
"""Several states of meshes side by side, with the curves along which they intersect."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import hpccd_core as hc
from hpccd_core.picture import curves
from hpccd_core.picture.contacts import BACKGROUND, INK, INTERSECTING, SUPERSAMPLING, as_bytes, render
from hpccd_core.picture.lines import Depth
from hpccd_core.whole_file import whole_file


@dataclasses.dataclass
class Panel:
    """meshes: name, vertices, faces, and edges beside theirs. intersecting: (F,) which of all faces intersect another
    mesh; None: not known."""

    title: str
    meshes: list[tuple[str, np.ndarray, np.ndarray, np.ndarray]]
    intersecting: np.ndarray | None = None
    contours: Sequence[hc.Contour] = ()
    depths: Sequence[Depth] = ()
    framed: np.ndarray | None = None  # (N,3) points that are in view; None: all


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
        image, camera, depth = render(
            panel.meshes, size, azimuth, elevation, intersecting=panel.intersecting, framed=panel.framed
        )
        axes = figure.add_subplot(rows, columns, number + 1)
        axes.imshow(image, extent=(0, size[0], size[1], 0))
        axes.set_axis_off()
        axes.set_title(panel.title, color=INK, fontsize=10)
        curves.draw(axes, panel.contours, camera, depth, SUPERSAMPLING)
        curves.draw_depths(axes, panel.depths, camera, SUPERSAMPLING)
        if panel.intersecting is not None and panel.intersecting.any():
            what = "bright green: faces that intersect another mesh"
            axes.text(0.5, -0.01, what, transform=axes.transAxes, ha="center", va="top", color=INTERSECTING, fontsize=8)
    figure.tight_layout()
    with whole_file(path, overwrite=True) as draft:
        draft.write_bytes(as_bytes(figure, draft.suffix, facecolor=BACKGROUND))
