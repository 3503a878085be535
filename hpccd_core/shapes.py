# SPDX-License-Identifier: Apache-2.0
"""Simple meshes to start with: vertices and faces as :meth:`Scene.add_mesh` and :meth:`Detector.detect` take them.

Each function returns vertices, (V, 3) float64, and faces, (F, 3) uint32. Faces of closed surfaces are
counterclockwise seen from outside. The same arguments give bit-identical numbers on every machine.

Examples
--------
>>> import hpccd_core as hc
>>> vertices, faces = hc.shapes.icosphere(4)
>>> vertices.shape, faces.shape
((162, 3), (320, 3))
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import arguments

_MOST = 2**15  # cells along a side: (2**15 + 1)**2 vertices are within what an index can name


def grid(columns: int, rows: int) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """A flat square sheet of triangles, such as cloth: x and y in [-1, 1], z = 0.

    Parameters
    ----------
    columns, rows : int
        Number of cells along x and along y, 1 to 32768. Each cell is two triangles.

    Returns
    -------
    vertices : ndarray, shape ((columns + 1) * (rows + 1), 3), float64
        Numbered row by row.
    faces : ndarray, shape (2 * columns * rows, 3), uint32
        Facing +z. Diagonals alternate.

    Raises
    ------
    TypeError, ValueError
        If `columns` or `rows` is not an integer in range.

    Examples
    --------
    >>> vertices, faces = grid(2, 1)
    >>> vertices[:, :2].tolist()
    [[-1.0, -1.0], [0.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [0.0, 1.0], [1.0, 1.0]]
    >>> cloth = 0.5 * vertices + [0.0, 0.0, 1.2]  # one metre wide, 1.2 m up
    """
    faces = grid_faces(columns, rows)
    columns, rows = int(columns), int(rows)  # small numpy integers would overflow
    x = 2.0 * np.arange(columns + 1) / columns - 1.0
    y = 2.0 * np.arange(rows + 1) / rows - 1.0
    vertices = np.stack([np.tile(x, rows + 1), np.repeat(y, columns + 1), np.zeros((rows + 1) * (columns + 1))], axis=1)
    return vertices, faces


def grid_faces(columns: int, rows: int, *, closed: bool = False, alternate: bool = True) -> NDArray[np.uint32]:
    """Faces of a grid whose vertices are numbered row by row: two triangles for each of columns x rows cells.

    Parameters
    ----------
    columns, rows : int
        Number of cells along both directions, 1 to 32768; at least 3 if closed.
    closed : bool
        If true, the last column joins the first one and the last row the first one, as on a torus: there are
        columns * rows vertices. If false, there are (columns + 1) * (rows + 1).
    alternate : bool
        If true, diagonals alternate from cell to cell, so that a folding sheet favours no direction.

    Returns
    -------
    ndarray, shape (2 * columns * rows, 3), uint32

    Raises
    ------
    TypeError, ValueError
        If `columns` or `rows` is not an integer in range, or `closed` or `alternate` is not a bool.

    Examples
    --------
    >>> grid_faces(1, 1).tolist()
    [[0, 1, 3], [0, 3, 2]]
    """
    closed, alternate = arguments.flag("closed", closed), arguments.flag("alternate", alternate)
    least = 3 if closed else 1  # two cells around would share all their vertices
    columns = arguments.whole_number("columns", columns, least, _MOST)
    rows = arguments.whole_number("rows", rows, least, _MOST)
    row, column = np.divmod(np.arange(rows * columns), columns)
    width = columns if closed else columns + 1
    below, right = (row + 1) % rows if closed else row + 1, (column + 1) % columns if closed else column + 1
    a, b = row * width + column, row * width + right
    c, d = below * width + column, below * width + right
    flip = ((row + column) & alternate).astype(bool)[:, None]
    first = np.where(flip, np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
    second = np.where(flip, np.stack([b, d, c], axis=1), np.stack([a, d, c], axis=1))
    return np.stack([first, second], axis=1).reshape(-1, 3).astype(np.uint32)


def icosphere(frequency: int) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """A sphere of radius 1 around the origin: each face of an icosahedron is divided into frequency**2 triangles.

    Parameters
    ----------
    frequency : int
        Number of segments along each edge of the icosahedron, 1 to 4096.

    Returns
    -------
    vertices : ndarray, shape (10 * frequency**2 + 2, 3), float64
    faces : ndarray, shape (20 * frequency**2, 3), uint32

    Raises
    ------
    TypeError, ValueError
        If `frequency` is not an integer in range.

    Examples
    --------
    >>> vertices, faces = icosphere(2)
    >>> ball = 0.3 * vertices + [0.0, 0.0, 0.3]  # radius 0.3 m, resting on z = 0
    >>> len(ball), len(faces)
    (42, 80)
    """
    n = arguments.whole_number("frequency", frequency, 1, 4096)
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
    vertices = _normalized(points.reshape(-1, 3)[first[order]])
    return vertices, rank[inverse.ravel()[faces]].astype(np.uint32)


def box(size: ArrayLike = (1.0, 1.0, 1.0)) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """An axis-aligned box around the origin: 8 vertices and 12 triangles.

    Parameters
    ----------
    size : ArrayLike, shape (3,)
        Lengths along x, y and z. One of them may be 0: a rectangle of 4 vertices and 2 triangles.

    Returns
    -------
    vertices : ndarray, shape (8, 3), float64
    faces : ndarray, shape (12, 3), uint32

    Raises
    ------
    TypeError, ValueError
        If `size` is not three finite lengths of which at most one is 0.

    Examples
    --------
    >>> vertices, faces = box((2.0, 1.0, 0.1))
    >>> vertices.max(axis=0).tolist()
    [1.0, 0.5, 0.05]
    """
    lengths = arguments.reals("size", size)
    if lengths.shape != (3,):
        raise ValueError(f"size: expected shape (3,), lengths along x, y and z, got {lengths.shape}")
    for k in range(3):
        arguments.length(f"size[{k}]", float(lengths[k]))
    half = lengths / 2
    if np.count_nonzero(half == 0.0) > 1:
        raise ValueError(f"size: at most one length may be 0, got {lengths.tolist()}")
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    flat = np.flatnonzero(half == 0.0)
    if len(flat) == 1:  # both sides coincide: a rectangle of two triangles
        (side,) = quads[2 * flat[0] :: 6]
        corners, quads = corners[list(side)] + 0.0, [(0, 1, 2, 3)]
    return corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], np.uint32)


def _normalized(points: NDArray[np.float64]) -> NDArray[np.float64]:
    # Sums are written out: numpy's own add in another order on other processors.
    x, y, z = points[:, 0], points[:, 1], points[:, 2]
    unit: NDArray[np.float64] = points / np.sqrt(x * x + y * y + z * z)[:, None]
    return unit
