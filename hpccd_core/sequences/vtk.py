# SPDX-License-Identifier: Apache-2.0
"""Surfaces in VTK and VTU files: polygons, and the boundaries of tetrahedra."""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..mesh_files.errors import shortened
from ..mesh_files.load import MeshFile
from .packages import needed
from .sequence import SequenceError
from .topology import checked_polygons
from .vtk_legacy import POLYGON, Cells, parse

SUFFIXES = (".vtk", ".vtu")
# VTK's numbers of cell types.
_NO_SURFACE = (1, 2, 3, 4)  # vertices, lines
_POLYGONS = (5, POLYGON, 9)  # triangles, quads
_TETRAHEDRON = 10
_OF_MESHIO = {"vertex": 1, "line": 3, "triangle": 5, "polygon": 7, "quad": 9, "tetra": 10}
# Corners of the faces of a tetrahedron, counterclockwise seen from outside.
_FACES_OF_TETRAHEDRON = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))


def load(path: Path) -> MeshFile:
    """Points and polygons of a file, in their order; boundaries of tetrahedra come last.

    Raises
    ------
    SequenceError
        The file is damaged, or has cells that are neither polygons nor tetrahedra.
    """
    if not path.is_file():
        raise SequenceError(f"{path}: is no file; give regular files")
    cells = parse(path, path.read_bytes()) if path.suffix.lower() == ".vtk" else _of_vtu(path)
    known = np.isin(cells.types, (*_NO_SURFACE, *_POLYGONS, _TETRAHEDRON))
    if not known.all():
        kind = cells.types[np.flatnonzero(~known)[0]]
        raise SequenceError(f"{path}: has cells of VTK's type {kind}; extract its surface as triangles or polygons")
    flat = np.isin(cells.types, _POLYGONS)
    counts, corners = cells.counts[flat], cells.corners[np.repeat(flat, cells.counts)]
    solid = cells.types == _TETRAHEDRON
    if solid.any():
        triangles = corners[np.repeat(counts == 3, counts)].reshape(-1, 3)
        boundary = _boundary(cells.corners[np.repeat(solid, cells.counts)].reshape(-1, 4), triangles)
        counts = np.concatenate([counts, np.full(len(boundary), 3)])
        corners = np.concatenate([corners, boundary.reshape(-1)])
    return MeshFile(path, checked_polygons(str(path), cells.points, corners, counts))


def _of_vtu(path: Path) -> Cells:
    meshio = needed("meshio.vtu", "meshio", path)
    try:
        mesh = meshio.read(str(path))
    except OSError:
        raise
    except Exception as error:  # meshio passes on any exception of its parsers
        why = shortened(" ".join(str(error).split())) or type(error).__name__
        raise SequenceError(f"{path}: cannot be read as VTU: {why}; copy or export it again") from error
    points = np.asarray(mesh.points, np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise SequenceError(f"{path}: its points have the shape {points.shape}; export points of three coordinates")
    corners, counts, types = ([np.zeros(0, np.int64)] for _ in range(3))
    for block in mesh.cells:
        if block.type not in _OF_MESHIO:
            raise SequenceError(f"{path}: has cells of type {block.type}; extract its surface as triangles or polygons")
        cells = np.asarray(block.data, np.int64)
        corners.append(cells.reshape(-1))
        counts.append(np.full(len(cells), cells.shape[1]))
        types.append(np.full(len(cells), _OF_MESHIO[block.type]))
    declared = sum(map(int, re.findall(rb"NumberOfCells\s*=\s*[\"'](\d+)", path.read_bytes())))
    if (left_out := declared - sum(map(len, counts))) > 0:  # meshio only warns
        raise SequenceError(f"{path}: cells of other types: {left_out}; extract its surface as triangles or polygons")
    return Cells(points, *(np.concatenate(parts) for parts in (corners, counts, types)))


def _boundary(tetrahedra: NDArray[np.int64], listed: NDArray[np.int64]) -> NDArray[np.int64]:
    """(F, 3): faces of one tetrahedron only that are not listed as triangles."""
    faces = tetrahedra[:, _FACES_OF_TETRAHEDRON].reshape(-1, 3)
    keys = np.sort(np.concatenate([faces, listed]), axis=1)
    _, first, count = np.unique(keys, axis=0, return_index=True, return_counts=True)
    return np.asarray(faces[np.sort(first[(count == 1) & (first < len(faces))])])
