# SPDX-License-Identifier: Apache-2.0
"""Faces from arrays and from files."""

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..mesh_files.load import FORMATS, load_mesh
from ..mesh_files.polygons import Polygons
from .sequence import SequenceError, SequenceMesh, reading

FACE_NAMES = ("faces", "triangles", "f")


def checked_faces(what: str, faces: NDArray[Any], n_vertices: int) -> NDArray[np.uint32]:
    """(F, 3) uint32 faces.

    Raises
    ------
    SequenceError
        They have another shape or type, or name a vertex that does not exist.
    """
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
        raise SequenceError(
            f"{what}: the faces are {faces.dtype} of shape {faces.shape}; give integers of shape (faces, 3)"
        )
    if not len(faces):
        raise SequenceError(f"{what}: has no faces; export the surface, not only points")
    bad = np.flatnonzero(((faces < 0) | (faces >= n_vertices)).any(axis=1))
    if bad.size:
        raise SequenceError(
            f"{what}: face {bad[0]} is {faces[bad[0]].tolist()}, and the mesh has {n_vertices} vertices; number them "
            "from 0, or give the faces of this mesh"
        )
    return np.ascontiguousarray(faces, np.uint32)


def checked_polygons(
    what: str, vertices: NDArray[np.float64], corners: NDArray[np.int64], counts: NDArray[np.int64]
) -> Polygons:
    """Polygons of at least three corners; points and lines are left out.

    Raises
    ------
    SequenceError
        There are none, or they name a vertex that does not exist.
    """
    if (counts < 0).any() or counts.sum() != len(corners):
        raise SequenceError(
            f"{what}: its polygons have {counts.sum()} corners, and {len(corners)} are listed; export it again"
        )
    large = counts >= 3
    if not large.any():
        raise SequenceError(f"{what}: has no faces; export the surface, not only points or lines")
    if not 0 <= corners.min() <= corners.max() < len(vertices):
        bad = corners.max() if corners.max() >= len(vertices) else corners.min()
        raise SequenceError(
            f"{what}: a face names vertex {bad}, and the mesh has {len(vertices)} vertices; export it again"
        )
    return Polygons(vertices, corners[np.repeat(large, counts)], counts[large])


def faces_of_file(path: Path, n_vertices: int) -> NDArray[np.uint32]:
    """(F, 3) uint32 faces of a mesh file or an array, for a mesh of ``n_vertices``.

    Raises
    ------
    SequenceError
        The file cannot be read, or does not fit the number of vertices.
    """
    suffix = path.suffix.lower()
    if not path.is_file():
        raise SequenceError(f"{path}: is no file; give a mesh file, .npy or .npz with the faces")
    if suffix in (".npy", ".npz"):
        with reading(str(path)):  # errors name this file
            return checked_faces(str(path), _array(path), n_vertices)
    if suffix not in FORMATS:
        raise SequenceError(f"{path}: is not a file with faces; use one of {', '.join((*FORMATS, '.npy', '.npz'))}")
    vertices, faces = load_mesh(path)
    if len(vertices) != n_vertices:
        raise SequenceError(
            f"{path}: has {len(vertices)} vertices, and the frames have {n_vertices}; give the mesh that was exported "
            "with the frames"
        )
    return faces


def _array(path: Path) -> NDArray[Any]:
    loaded: Any = np.load(path, allow_pickle=False)
    if not isinstance(loaded, np.ndarray):
        with loaded:
            name = next((n for n in (*FACE_NAMES, *loaded.files) if n in loaded.files), None)
            if name is None or (name not in FACE_NAMES and len(loaded.files) > 1):
                raise SequenceError(f"{path}: has no array named {' or '.join(FACE_NAMES)}; name the faces so")
            return np.asarray(loaded[name])
    array: NDArray[Any] = loaded
    return array


def same_or(last: tuple[SequenceMesh, ...] | None, meshes: tuple[SequenceMesh, ...]) -> tuple[SequenceMesh, ...]:
    """``last`` if its topology is that of ``meshes``, otherwise ``meshes``."""
    if last is None or len(last) != len(meshes):
        return meshes
    for a, b in zip(last, meshes, strict=True):
        if a is b:
            continue
        if (a.name, a.n_vertices) != (b.name, b.n_vertices) or not np.array_equal(a.faces, b.faces):
            return meshes
    return last


def short_names(paths: list[str], separator: str) -> list[str]:
    """The last parts of paths, or whole paths where two of these parts are the same."""
    last = [path.rpartition(separator)[2] or path for path in paths]
    counts = Counter(last)
    return [path if counts[name] > 1 else name for path, name in zip(paths, last, strict=True)]
