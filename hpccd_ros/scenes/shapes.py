# SPDX-License-Identifier: Apache-2.0
"""Procedural closed surfaces and sheets: (V,3) float64 vertices and (F,3) uint32 faces, outward winding."""

from __future__ import annotations

import numpy as np

from hpccd_ros.scenes.exactmath import PI, cross, normalized, sincos


def icosphere(frequency: int):
    """Unit sphere of 20 * frequency**2 faces: each face of an icosahedron cut into frequency**2."""
    golden = (1 + 5**0.5) / 2
    corners = np.array(
        [
            (-1, golden, 0),
            (1, golden, 0),
            (-1, -golden, 0),
            (1, -golden, 0),
            (0, -1, golden),
            (0, 1, golden),
            (0, -1, -golden),
            (0, 1, -golden),
            (golden, 0, -1),
            (golden, 0, 1),
            (-golden, 0, -1),
            (-golden, 0, 1),
        ]
    )
    sides = np.array(
        [
            (0, 11, 5),
            (0, 5, 1),
            (0, 1, 7),
            (0, 7, 10),
            (0, 10, 11),
            (1, 5, 9),
            (5, 11, 4),
            (11, 10, 2),
            (10, 7, 6),
            (7, 1, 8),
            (3, 9, 4),
            (3, 4, 2),
            (3, 2, 6),
            (3, 6, 8),
            (3, 8, 9),
            (4, 9, 5),
            (2, 4, 11),
            (6, 2, 10),
            (8, 6, 7),
            (9, 8, 1),
        ]
    )
    n = frequency
    i, j = np.divmod(np.arange((n + 1) * (n + 1)), n + 1)
    inside = i + j <= n
    i, j = i[inside], j[inside]
    weights = np.stack([n - i - j, i, j], axis=1)  # integer barycentric weights of the points of one side
    number = np.full((n + 1, n + 1), -1)
    number[i, j] = np.arange(len(i))
    # Sides share the points of their common edge. A point is known by its integer weights on the twelve
    # corners, summed up to one 64-bit key that does not depend on the side it is seen from.
    keys_of_corner = np.array([pow(6364136223846793005, c + 1, 2**64) for c in range(12)], dtype=np.uint64)
    keys = (keys_of_corner[sides][:, None, :] * weights.astype(np.uint64)[None]).sum(axis=2).ravel()
    points = np.zeros((20, len(i), 3))
    for corner in range(3):
        points += corners[sides[:, corner]][:, None, :] * weights[None, :, corner, None]
    _, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")  # number points as they are met, so that neighbours lie close
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    up = (i + j) < n
    down = up & (i > 0)
    a, b = i[up], j[up]
    small = [np.stack([number[a, b], number[a + 1, b], number[a, b + 1]], axis=1)]
    a, b = i[down], j[down]
    small.append(np.stack([number[a, b], number[a, b + 1], number[a - 1, b + 1]], axis=1))
    local = np.concatenate(small)
    faces = (np.arange(20)[:, None, None] * len(i) + local[None]).reshape(-1, 3)
    vertices = normalized(points.reshape(-1, 3)[first[order]])
    return vertices, rank[inverse.ravel()[faces]].astype(np.uint32)


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
    return vertices, _quads(along, around, wrap=True)


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


def sheet(columns: int, rows: int):
    """Flat square [-1,1]^2 at z = 0 of 2 * columns * rows faces facing +z, vertices numbered row by row."""
    x = 2.0 * np.arange(columns + 1) / columns - 1.0
    y = 2.0 * np.arange(rows + 1) / rows - 1.0
    vertices = np.stack([np.tile(x, rows + 1), np.repeat(y, columns + 1), np.zeros((rows + 1) * (columns + 1))], axis=1)
    return vertices, _quads(rows, columns, wrap=False)


def board(columns: int, rows: int):
    """Closed box [-1,1]^2 x [-1,0], its top and bottom of columns x rows cells: 4 * (columns * rows + columns + rows)
    faces."""
    top, _ = sheet(columns, rows)
    # All diagonals alike: along the rim, where shaded normals are means of faces, others would show as scallops.
    faces = _quads(rows, columns, wrap=False, alternate=False)
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
    return vertices.reshape(-1, 3), _quads(around, len(profile), wrap=True)


def rod_faces(rings: int, around: int):
    """Faces of a closed rod: `rings` of `around` points one after the other, then the middles of its two ends."""
    # The sides are a strip that is closed around: a grid with the seam's points taken for one.
    corners = _quads(rings - 1, around, wrap=False)
    ring, place = np.divmod(corners, np.uint32(around + 1))
    sides = ring * np.uint32(around) + place % np.uint32(around)
    this = np.arange(around)
    after, last, first_end = (this + 1) % around, (rings - 1) * around, rings * around
    ends = [
        np.stack([np.full(around, first_end), after, this], axis=1),
        np.stack([np.full(around, first_end + 1), last + this, last + after], axis=1),
    ]
    return np.concatenate([sides, *ends]).astype(np.uint32)


def _quads(rows: int, columns: int, wrap: bool, alternate: bool = True):
    """Two triangles for each cell of a grid of rows x columns cells, closed in both directions if `wrap`."""
    row, column = np.divmod(np.arange(rows * columns), columns)
    width = columns if wrap else columns + 1
    below, right = (row + 1) % rows if wrap else row + 1, (column + 1) % columns if wrap else column + 1
    a, b = row * width + column, row * width + right
    c, d = below * width + column, below * width + right
    # Alternate the diagonal, lest a folding sheet favour one direction.
    flip = ((row + column) & alternate).astype(bool)[:, None]
    first = np.where(flip, np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
    second = np.where(flip, np.stack([b, d, c], axis=1), np.stack([a, d, c], axis=1))
    return np.stack([first, second], axis=1).reshape(-1, 3).astype(np.uint32)
