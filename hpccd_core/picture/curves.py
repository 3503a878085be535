# SPDX-License-Identifier: Apache-2.0
"""The curves along which meshes intersect, and arrows of how deep."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import FancyArrowPatch
from matplotlib.patheffects import withStroke

import hpccd_core as hc
from hpccd_core.picture.camera import Camera
from hpccd_core.picture.lines import Depth

COLOUR = "#ff5f45"
DEPTH = "#ffffff"
MOST_LENGTHS = 12  # written beside arrows; more would cover each other


def draw(axes: Axes, contours: Sequence[hc.Contour], camera: Camera, depth: np.ndarray, scale: float = 1.0) -> None:
    """Draw intersection curves over a rendered image; faint where they are behind a surface.

    depth: (h, w), in the pixels of the camera. scale: pixels of the camera in a unit of the axes.
    """
    ends = [np.concatenate([c.points, c.points[:1]]) if c.closed else c.points for c in contours if len(c) > 1]
    if not ends:
        return
    segments = np.concatenate([np.stack([points[:-1], points[1:]], axis=1) for points in ends])
    seen = camera.project(segments.reshape(-1, 3)).reshape(-1, 2, 3)
    hidden = behind(seen.mean(axis=1), depth)
    for which, alpha in ((hidden, 0.45), (~hidden, 1.0)):
        lines = seen[which, :, :2] / scale
        axes.add_collection(LineCollection(lines, colors=COLOUR, linewidths=1.6, alpha=alpha, capstyle="round"))


def behind(places: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """(n,) bool: which points (n, 3), in pixels and depth, are behind the surface that is drawn there."""
    column = np.clip(places[:, 0].astype(int), 0, depth.shape[1] - 1)
    row = np.clip(places[:, 1].astype(int), 0, depth.shape[0] - 1)
    drawn = depth[np.isfinite(depth)]  # none where faces cover no pixel, as those without area
    hidden: np.ndarray = places[:, 2] > depth[row, column] + (0.01 * np.ptp(drawn) if len(drawn) else 0.0)
    return hidden


def draw_depths(axes: Axes, depths: Sequence[Depth], camera: Camera, scale: float = 1.0, unit: float = 1.0) -> None:
    """Draw an arrow for each depth, in front of everything, as most begin inside a mesh; of few with their lengths.

    scale: pixels of the camera in a unit of the axes. unit: the length of the unit of the positions, for the text.
    """
    outline = [withStroke(linewidth=4.0, foreground="#10141c")]
    for depth in depths:
        start, end = camera.project(np.stack([depth.start, depth.end]))[:, :2] / scale
        style: dict[str, Any] = {
            "arrowstyle": "-|>",
            "mutation_scale": 13,
            "shrinkA": 0,
            "shrinkB": 0,
            "linewidth": 1.8,
        }
        axes.add_patch(FancyArrowPatch(start, end, color=DEPTH, path_effects=outline, zorder=4, **style))
        if len(depths) <= MOST_LENGTHS:
            text = axes.annotate(f"{unit * depth.length:.3g}", end, (7, 5), textcoords="offset points", zorder=5)
            text.set(color=DEPTH, fontsize=10, path_effects=outline)
