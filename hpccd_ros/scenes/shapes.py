# SPDX-License-Identifier: Apache-2.0
"""Closed surfaces that scenes are made of, beside hpccd_core.shapes: (V,3) float64 vertices and (F,3) uint32 faces,
outward winding."""

from __future__ import annotations

import numpy as np

from hpccd_core.shapes import grid, grid_faces, icosphere
from hpccd_ros.scenes.exactmath import PI, cross, normalized, sincos


def rounded_cube(frequency: int):
    """Unit 4-norm ball: a cube with round edges, 20 * frequency**2 faces."""
    vertices, faces = icosphere(frequency)
    squared = vertices * vertices
    norm = np.sqrt(
        np.sqrt(squared[:, 0] * squared[:, 0] + squared[:, 1] * squared[:, 1] + squared[:, 2] * squared[:, 2])
    )
    return vertices / norm[:, None], faces


def tube(centres, normals, tangents, radii):
    """Closed tube around a closed curve: 2 * A * B faces.

    `centres`, unit `normals` and `tangents` are (A,3) along the curve; `radii` (A,B) around it.
    """
    along, around = radii.shape
    s, c = sincos(np.arange(around) * (2 * PI / around))
    sideways = cross(tangents, normals)
    offset = normals[:, None, :] * c[None, :, None] + sideways[:, None, :] * s[None, :, None]
    vertices = (centres[:, None, :] + offset * radii[..., None]).reshape(-1, 3)
    return vertices, grid_faces(around, along, closed=True)


def torus(along: int, around: int, radius: float = 0.7, thickness: float = 0.3):
    """Torus around z of 2 * along * around faces."""
    s, c = sincos(np.arange(along) * (2 * PI / along))
    zero = np.zeros_like(s)
    out = np.stack([c, s, zero], axis=1)
    return tube(radius * out, out, np.stack([-s, c, zero], axis=1), np.full((along, around), thickness))


def torus_knot_curve(along: int, p: int, q: int, radius: float, swing: float):
    """Points, unit normals and unit tangents (along,3 each) of the (p,q) torus knot around z.

    The normal is that of the torus it winds on: periodic, so that a tube around it closes without a twist.
    """
    angle = np.arange(along) * (2 * PI / along)
    sp, cp = sincos(p * angle)
    sq, cq = sincos(q * angle)
    rho, zero = radius + swing * cq, np.zeros_like(sp)
    points = np.stack([rho * cp, rho * sp, swing * sq], axis=1)
    ring = np.stack([cp, sp, zero], axis=1)
    tangents = normalized(
        np.stack([-sp, cp, zero], axis=1) * (p * rho)[:, None]
        + ring * (-q * swing * sq)[:, None]
        + np.stack([zero, zero, q * swing * cq], axis=1)
    )
    normals = ring * cq[:, None] + np.stack([zero, zero, sq], axis=1)
    return points, normals, tangents


def board(columns: int, rows: int):
    """Closed box [-1,1]^2 x [-1,0], its top and bottom of columns x rows cells: 4 * (columns * rows + columns + rows)
    faces."""
    top, _ = grid(columns, rows)
    # All diagonals alike: along the rim, where shaded normals are means of faces, others would show as scallops.
    faces = grid_faces(columns, rows, alternate=False)
    count = len(top)
    across, along = np.arange(columns), np.arange(rows) * (columns + 1)
    # Once around the rim, seen from above against the clock.
    rim = np.concatenate([across, along + columns, (count - 1) - across, (count - 1) - columns - along])
    after = np.roll(rim, -1)
    sides = [np.stack([rim + count, after + count, after], axis=1), np.stack([rim + count, after, rim], axis=1)]
    below = faces[:, ::-1].astype(np.int64) + count
    vertices = np.concatenate([top, top - (0.0, 0.0, 1.0)])
    return vertices, np.concatenate([faces, below, *sides]).astype(np.uint32)


def revolved(profile, around: int):
    """Surface of 2 * len(profile) * around faces that a closed `profile` (N,2: radius, y) leaves in turning round y.

    `profile` runs so that the solid is on its left, y to the right and the radius upwards: that winds outwards.
    """
    s, c = sincos(np.arange(around) * (2 * PI / around))
    radius, y = profile[:, 0], profile[:, 1]
    vertices = np.stack([s[:, None] * radius[None, :], np.tile(y, (around, 1)), c[:, None] * radius[None, :]], axis=-1)
    return vertices.reshape(-1, 3), grid_faces(len(profile), around, closed=True)


def rod_faces(rings: int, around: int):
    """Faces of a closed rod: `rings` of `around` points one after the other, then the middles of its two ends."""
    # The sides are a strip that is closed around: a grid with the seam's points taken for one.
    corners = grid_faces(around, rings - 1)
    ring, place = np.divmod(corners, np.uint32(around + 1))
    sides = ring * np.uint32(around) + place % np.uint32(around)
    this = np.arange(around)
    after, last, first_end = (this + 1) % around, (rings - 1) * around, rings * around
    ends = [
        np.stack([np.full(around, first_end), after, this], axis=1),
        np.stack([np.full(around, first_end + 1), last + this, last + after], axis=1),
    ]
    return np.concatenate([sides, *ends]).astype(np.uint32)
