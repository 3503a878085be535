# SPDX-License-Identifier: Apache-2.0
"""One mesh file for each frame, or one for each mesh and frame."""

import dataclasses
import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..mesh_files.errors import LONGEST, shortened
from ..mesh_files.load import FORMATS, MeshFile, load_polygons
from . import vtk
from .numbering import arrange
from .sequence import FrameSequence, SequenceError, SequenceMesh
from .topology import same_or

SUFFIXES = (*FORMATS, *vtk.SUFFIXES)


def in_folder(folder: Path) -> list[Path]:
    """The mesh files in a folder; reads the listing only.

    Raises
    ------
    SequenceError
        There are none, or several formats.
    """
    with os.scandir(folder) as entries:
        listed = [(entry.name, entry.is_dir()) for entry in entries if not entry.name.startswith(".")]
    names = sorted(name for name, is_folder in listed if not is_folder)
    by_suffix: dict[str, list[Path]] = {}
    for name in names:
        if (suffix := Path(name).suffix.lower()) in SUFFIXES:
            by_suffix.setdefault(suffix, []).append(folder / name)
    if not by_suffix:
        there = sorted(f"{name}/" if is_folder else name for name, is_folder in listed)
        others = f" (it has {', '.join(there[:3])}{', ...' if len(there) > 3 else ''})" if there else ""
        raise SequenceError(
            f"{folder}: has no mesh files{others}; give a folder with {', '.join(SUFFIXES)} files, a pattern such as "
            f"'{folder}/*/*.obj', or files with all frames, such as '{folder}/*.npz'"
        )
    if len(by_suffix) > 1:
        first, second = sorted(by_suffix)[:2]
        raise SequenceError(
            f"{folder}: has {first} and {second} files; give a pattern of one format, such as '{folder}/*{first}'"
        )
    return next(iter(by_suffix.values()))


@dataclasses.dataclass(frozen=True)
class _Read:
    """The last file of a mesh. is_settled: files with the same polygons have the same faces, whatever the positions."""

    path: Path
    file: MeshFile
    mesh: SequenceMesh
    is_settled: bool


class MeshFolder(FrameSequence):
    """Mesh files, each read when its frame is.

    Parameters
    ----------
    files : list of Path
        In any order.
    source : str
        The files, for messages.
    """

    def __init__(self, files: list[Path], source: str) -> None:
        numbered = arrange(files)
        self._files, self._names = numbered.meshes, numbered.names
        super().__init__(source, numbered.n_frames, numbered.notes, numbered.missing)

    def _read(self, index: int) -> tuple[str, tuple[SequenceMesh, ...], NDArray[np.float64]]:
        files = [of_mesh[index if len(of_mesh) > 1 else 0] for of_mesh in self._files.values()]
        pairs = [self._mesh(name, file) for name, file in zip(self._files, files, strict=True)]
        meshes = tuple(mesh for mesh, _ in pairs)
        last = self._opened.get("meshes", ())
        if len(last) != len(meshes) or any(a is not b for a, b in zip(meshes, last, strict=True)):
            self._opened["meshes"] = last = meshes
        moving = [file for file, of_mesh in zip(files, self._files.values(), strict=True) if len(of_mesh) > 1]
        label = shortened(", ".join(self._names[file] for file in moving or files), 2 * LONGEST)
        return label, last, np.concatenate([v for _, v in pairs])

    def _mesh(self, name: str, path: Path) -> tuple[SequenceMesh, NDArray[np.float64]]:
        """A mesh, the same object as in the frame before if its topology is the same, and its positions.

        How polygons are split depends on positions. Those of the first frame count wherever the polygons are the same:
        faces neither change from frame to frame nor depend on the frame that was read before.
        """
        last: _Read | None = self._opened.get(f"last {name}")
        if last is not None and last.path == path:
            return last.mesh, last.file.polygons.vertices
        file = _loaded(path, None if last is None else last.file)
        if path.suffix.lower() == ".stl":
            file = self._joined_as_first(name, file)
        vertices = file.polygons.vertices
        if last is not None and _same(file, last.file):  # one copy of the polygons stays in memory
            file = dataclasses.replace(file, polygons=dataclasses.replace(last.file.polygons, vertices=vertices))
            if last.is_settled:
                self._opened[f"last {name}"] = _Read(path, file, last.mesh, True)
                return last.mesh, vertices
        shape, is_settled = None, True
        if (file.polygons.counts != 3).any():
            first = self._first(name)
            is_settled = _same(file, first)
            shape = first.polygons.vertices if is_settled else None
        mesh = SequenceMesh(name, file.faces(shape), len(vertices))
        (mesh,) = same_or(None if last is None else (last.mesh,), (mesh,))
        self._opened[f"last {name}"] = _Read(path, file, mesh, is_settled)
        return mesh, vertices

    def _first(self, name: str) -> MeshFile:
        key = f"first {name}"
        if key not in self._opened:
            self._opened[key] = _loaded(self._files[name][0])
        first: MeshFile = self._opened[key]
        return first

    def _joined_as_first(self, name: str, file: MeshFile) -> MeshFile:
        """STL has no numbers of vertices: corners are joined as in the first frame where they are equal here too."""
        first = self._first(name).polygons
        polygons = file.polygons
        corners = polygons.vertices[polygons.corners]
        if len(corners) != len(first.corners):
            return file
        vertices = np.empty_like(first.vertices)
        vertices[first.corners] = corners
        if (vertices[first.corners] != corners).any():
            return file
        return MeshFile(file.path, dataclasses.replace(first, vertices=vertices))


def _loaded(path: Path, last: MeshFile | None = None) -> MeshFile:
    return vtk.load(path) if path.suffix.lower() in vtk.SUFFIXES else load_polygons(path, last)


def _same(a: MeshFile, b: MeshFile) -> bool:
    """Whether the polygons are the same."""
    p, q = a.polygons, b.polygons
    return (
        len(p.vertices) == len(q.vertices)
        and (p.counts is q.counts or np.array_equal(p.counts, q.counts))
        and (p.corners is q.corners or np.array_equal(p.corners, q.corners))
    )
