# SPDX-License-Identifier: Apache-2.0
"""Pictures of the frames of a generated scene, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hpccd_ros.base.whole_file import whole_file
from hpccd_ros.frames.types import NO_EDGES
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

    from hpccd_ros.picture.contacts import BACKGROUND, INK, render

    columns = min(3, len(indices))
    rows = -(-len(indices) // columns)
    size = (width, width * 3 // 4)
    figure = Figure(figsize=(columns * size[0] / 100, rows * (size[1] + 40) / 100), dpi=100, facecolor=BACKGROUND)
    FigureCanvasAgg(figure)
    for panel, index in enumerate(indices):
        frame = scene.frame(index)
        parts = [(*part, NO_EDGES) for part in zip(scene.mesh_names, frame, scene.faces(index), strict=True)]
        untouched = np.full(sum(map(len, frame)), np.nan)
        image, _, _ = render(parts, untouched, size, azimuth, elevation)
        axes = figure.add_subplot(rows, columns, panel + 1)
        axes.imshow(image)
        axes.set_axis_off()
        axes.set_title(
            f"{scene.name}, frame {index}: {sum(map(len, scene.faces(index))):,} triangles", color=INK, fontsize=10
        )
    figure.tight_layout()
    with whole_file(path, overwrite=True) as draft:
        figure.savefig(draft, facecolor=BACKGROUND)
