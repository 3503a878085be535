# SPDX-License-Identifier: Apache-2.0
"""Triangulate polygons: by the fan of the first corner if that is a triangulation, otherwise by ear clipping."""

import dataclasses
import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import MeshFileError

# Bound on the rounding of the sums below, for polygons of size 1.
ROUNDING = 1e-12
# The coordinates of most files were float32 once: rounding may make a polygon cross itself by this relative amount.
FLOAT32 = 1e-7
# Ear clipping is quadratic and holds the interpreter lock: 0.03 s for this number of corners, 13 s for 100,000.
MOST_CORNERS = 8_000


@dataclasses.dataclass(frozen=True)
class Polygons:
    """The polygons of a file and its vertices.

    Parameters
    ----------
    vertices : (V, 3) float64
        Finite.
    corners : (sum of counts,) int64
        The vertices of each polygon, one polygon after the other.
    counts : (P,) int64
        The number of corners of each polygon, at least 3.
    """

    vertices: NDArray[np.float64]
    corners: NDArray[np.int64]
    counts: NDArray[np.int64]

    def triangles(self) -> NDArray[np.int64]:
        """(F, 3) vertices: n - 2 triangles of each polygon of n corners, in the order of the polygons.

        Triangle k of a fan is (first corner, corner k + 1, corner k + 2).

        Raises
        ------
        MeshFileError
            A polygon crosses itself in such a way that its triangles have another area, or a polygon needs
            ``mapbox_earcut`` and it is not installed.
        """
        if (self.counts == 3).all():
            return self.corners.reshape(-1, 3)
        starts = np.cumsum(self.counts) - self.counts
        of_each = self.counts - 2
        first = np.repeat(starts, of_each)
        step = np.arange(len(first)) - np.repeat(np.cumsum(of_each) - of_each, of_each)
        faces: NDArray[np.int64] = self.corners[np.stack([first, first + step + 1, first + step + 2], axis=1)]
        for polygon in np.flatnonzero(~self._fans(faces)):
            end = int(np.sum(of_each[: polygon + 1]))
            corners = self.corners[starts[polygon] : starts[polygon] + self.counts[polygon]]
            try:
                faces[end - of_each[polygon] : end] = corners[_ears(self.vertices[corners])]
            except MeshFileError as error:
                raise MeshFileError(f"polygon {polygon} (of {len(corners)} corners): {error}") from None
        return faces

    def second_of_quads(self) -> NDArray[np.bool_]:
        """Whether each triangle of `triangles` is the second one of a quad."""
        of_each = self.counts - 2
        second = np.zeros(int(of_each.sum()), bool)
        second[np.cumsum(of_each)[self.counts == 4] - 1] = True
        return second

    def _fans(self, faces: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether the fan of each polygon is a triangulation. Also true for polygons without area: any one will do."""
        fine: NDArray[np.bool_] = self.counts == 3
        large = np.flatnonzero(~fine)
        of_each = (self.counts - 2)[large]
        starts = np.cumsum(of_each) - of_each
        rows = faces[np.repeat(~fine, self.counts - 2)]
        first, sides = self.vertices[rows[:, 0]], self.vertices[rows[:, 1:]]
        sides = sides - first[:, None]
        # Scale each polygon by its own size: products of coordinates up to 1e150 must neither overflow nor underflow.
        size = np.maximum.reduceat(np.abs(sides).max(axis=(1, 2), initial=0.0), starts)
        sides = sides / np.repeat(np.where(size > 0, size, 1.0), of_each)[:, None, None]
        areas = np.cross(sides[:, 0], sides[:, 1])
        total = np.add.reduceat(areas, starts)
        length = np.sqrt((total * total).sum(axis=1))
        largest = np.maximum.reduceat(np.abs(areas).max(axis=1), starts)
        no_area = largest <= ROUNDING
        normal = np.repeat(total / np.where(length > 0, length, 1.0)[:, None], of_each, axis=0)
        height = (areas * normal).sum(axis=1)  # twice the area of each triangle in the best plane, with its sign
        turned = np.minimum.reduceat(height, starts) < -ROUNDING
        # Seen from its first corner, a polygon winds by less than a full turn; a spiral winds further, and overlaps.
        along = (sides * normal[:, None]).sum(axis=2)
        dot = (sides[:, 0] * sides[:, 1]).sum(axis=1) - along[:, 0] * along[:, 1]
        angle = np.add.reduceat(np.arctan2(np.maximum(height, 0.0), dot), starts)
        fine[large] = no_area | ((length > ROUNDING) & ~turned & (angle < 2 * np.pi))
        return fine


def _ears(positions: NDArray[np.float64]) -> NDArray[np.intp]:
    """(n - 2, 3) corners: a triangulation of the polygon in its best plane, oriented like the polygon."""
    if len(positions) > MOST_CORNERS:
        raise MeshFileError(f"is not convex and has more than {MOST_CORNERS} corners; split it into smaller polygons")
    flat, area, noise = _in_best_plane(positions)
    try:
        earcut: Any = importlib.import_module("mapbox_earcut")
    except ModuleNotFoundError:
        raise MeshFileError(
            "is not convex, and splitting it into triangles needs the Python package mapbox_earcut; install it with: "
            "pip install 'mapbox_earcut~=2.1.0' (it is in the extra 'meshes')"
        ) from None
    # Without corners that repeat the previous one, which it treats differently in each direction. They return below.
    kept = np.flatnonzero((positions != np.roll(positions, 1, axis=0)).any(axis=1))
    ends = np.array([len(kept)], np.uint32)
    faces = kept[np.asarray(earcut.triangulate_float64(flat[kept], ends), np.intp).reshape(-1, 3)]
    if _signed_areas(flat, faces).sum() < 0:
        faces = faces[:, ::-1]
    faces = _with_all_corners(faces, len(flat))
    if len(faces) != len(flat) - 2 or abs(np.abs(_signed_areas(flat, faces)).sum() - area) > noise:
        raise MeshFileError("crosses itself or is far from flat; split it into triangles where the file was made")
    return faces


def _in_best_plane(positions: NDArray[np.float64]) -> tuple[NDArray[np.float64], float, float]:
    """((n, 2) coordinates in the plane of the polygon's area vector, scaled to size 1; twice its area; the difference
    that rounding may make between that and a sum of areas)."""
    sides = positions - positions[0]
    size = np.abs(sides).max()
    sides = sides / size
    total = np.cross(sides[1:-1], sides[2:]).sum(axis=0)
    area = float(np.sqrt(total @ total))
    if area <= ROUNDING:
        raise MeshFileError("crosses itself or is far from flat; split it into triangles where the file was made")
    normal = total / area
    along = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    along = along / np.sqrt(along @ along)
    flat = np.stack([sides @ along, sides @ np.cross(normal, along)], axis=1)
    noise = 1e-6 * area + FLOAT32 * float(np.abs(positions).max() / size)
    return np.ascontiguousarray(flat), area, noise


def _signed_areas(flat: NDArray[np.float64], faces: NDArray[np.intp]) -> NDArray[np.float64]:
    """Twice the signed area of each triangle; negative if it is clockwise."""
    u, v = flat[faces[:, 1]] - flat[faces[:, 0]], flat[faces[:, 2]] - flat[faces[:, 0]]
    areas: NDArray[np.float64] = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    return areas


def _with_all_corners(faces: NDArray[np.intp], n: int) -> NDArray[np.intp]:
    """Add corners on straight sides, which the triangulation may lack.

    Neighbours of the polygon use these corners: without them the surface would tear there as soon as it moves.
    """
    used = np.unique(faces)
    if len(used) == n or not len(used):
        return faces
    whole = [tuple(face) for face in faces.tolist()]
    for a, b in zip(used.tolist(), np.roll(used, -1).tolist(), strict=True):
        between = [(a + 1 + k) % n for k in range((b - a - 1) % n)]
        if between:
            at = next((i for i, f in enumerate(whole) if (a, b) in ((f[0], f[1]), (f[1], f[2]), (f[2], f[0]))), None)
            if at is None:
                return faces
            (opposite,) = set(whole[at]) - {a, b}
            chain = [a, *between, b]
            whole[at : at + 1] = [(opposite, p, q) for p, q in zip(chain, chain[1:], strict=False)]
    return np.array(whole, np.intp)
