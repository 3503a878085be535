# SPDX-License-Identifier: Apache-2.0
"""Lines that pictures show: intersection curves as polylines, and how deep two meshes penetrate."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import hpccd_core as hc


@dataclass(frozen=True, eq=False)
class Depth:
    """How far ``mesh_a`` must move to be free of ``mesh_b``: the shortest translation found.

    ``start``: (3,) the point of mesh a that touches mesh b after the translation, before it. Where the core names no
    features, the middle of their intersection curves; inside a mesh, the middle of mesh a.
    """

    mesh_a: str
    mesh_b: str
    start: np.ndarray
    translation: np.ndarray

    @property
    def end(self) -> np.ndarray:
        return self.start + self.translation

    @property
    def length(self) -> float:
        return float(np.linalg.norm(self.translation))


def polylines(contours: Sequence[hc.Contour], most: int) -> list[np.ndarray]:
    """[(n,3)] of contours of more than one point, closed ones with their first point at the end.

    most: points of all; where there are more, every k-th of each is kept, and its ends. The longest stay where that
    would not suffice.
    """
    lines = [np.concatenate([c.points, c.points[: int(c.closed)]]) for c in contours if len(c) > 1]
    if 2 * len(lines) > most:
        longest = sorted(range(len(lines)), key=lambda k: -len(lines[k]))[: most // 2]
        lines = [lines[k] for k in sorted(longest)]
    counts = np.array([len(line) - 1 for line in lines], np.int64)  # of segments
    step = max(1, int(counts.sum()) // max(most, 1))
    while (-(-counts // step) + 1).sum() > most:
        step += 1
    return [line[np.append(np.arange(0, len(line) - 1, step), len(line) - 1)] for line in lines]
