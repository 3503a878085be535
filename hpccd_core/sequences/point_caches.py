# SPDX-License-Identifier: Apache-2.0
"""Point caches of one mesh: PC2, PC16 and MDD. Their faces come from another file."""

import os
import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .sequence import FrameSequence, SequenceError, SequenceMesh
from .topology import faces_of_file

SUFFIXES = (".pc2", ".pc16", ".mdd")
_PC2 = struct.Struct("<12siiffi")  # signature, version, vertices, first frame, frames a sample, samples
_MDD = struct.Struct(">ii")  # frames, vertices; times in seconds follow


class PointCache(FrameSequence):
    """A PC2, PC16 (the same in float16, as in CLOTH3D) or MDD file, by its suffix.

    Parameters
    ----------
    path : Path
        The file.
    faces : Path or None
        A file with the faces of the mesh.
    """

    def __init__(self, path: Path, faces: Path | None) -> None:
        size = os.stat(path).st_size
        with open(path, "rb") as file:
            head = file.read(_PC2.size)
        suffix = path.suffix.lower()
        if suffix != ".mdd":
            n_frames, n_vertices = _pc2_header(path, head)
            self._begin, self._dtype = _PC2.size, np.dtype("<f4" if suffix == ".pc2" else "<f2")
        else:
            n_frames, n_vertices = _mdd_header(path, head)
            self._begin, self._dtype = _MDD.size + 4 * n_frames, np.dtype(">f4")
        self._path = path
        if n_frames < 0 or n_vertices < 1:
            raise SequenceError(f"{path}: declares {n_frames} frames of {n_vertices} vertices; export it again")
        self._size = n_vertices * 3 * self._dtype.itemsize  # bytes of a frame
        expected = self._begin + n_frames * self._size
        if size != expected:
            problem = "is cut off" if size < expected else "is too long"
            raise SequenceError(f"{path}: {problem}: it has {size} of {expected} bytes; copy or export it again")
        super().__init__(str(path), n_frames, (f"positions are {self._dtype.newbyteorder('=')}",))
        if faces is None:
            raise SequenceError(f"{path}: has no faces; give the mesh file that belongs to it (--faces FILE)")
        self._meshes = (SequenceMesh(path.stem, faces_of_file(faces, n_vertices), n_vertices),)

    def _read(self, index: int) -> tuple[str, tuple[SequenceMesh, ...], NDArray[np.float64]]:
        if "file" not in self._opened:
            self._opened["file"] = open(self._path, "rb")
        self._opened["file"].seek(self._begin + index * self._size)
        positions = np.frombuffer(self._opened["file"].read(self._size), self._dtype).reshape(-1, 3)
        return f"{self._path.name}[{index}]", self._meshes, positions.astype(np.float64)


def _pc2_header(path: Path, head: bytes) -> tuple[int, int]:
    """(frames, vertices)."""
    if len(head) < _PC2.size or not head.startswith(b"POINTCACHE2"):
        raise SequenceError(f"{path}: is not a PC2 file (it does not begin with POINTCACHE2); export it again")
    _, version, n_vertices, _, _, n_frames = _PC2.unpack(head)
    if version != 1:
        raise SequenceError(f"{path}: is PC2 of version {version}; export version 1")
    return n_frames, n_vertices


def _mdd_header(path: Path, head: bytes) -> tuple[int, int]:
    """(frames, vertices)."""
    if len(head) < _MDD.size:
        raise SequenceError(f"{path}: is not an MDD file (it has {len(head)} bytes); export it again")
    n_frames, n_vertices = _MDD.unpack(head[: _MDD.size])
    return n_frames, n_vertices
