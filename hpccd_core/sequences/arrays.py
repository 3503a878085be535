# SPDX-License-Identifier: Apache-2.0
"""Arrays of positions (frames, vertices, 3) in NPY and NPZ files, read one frame at a time."""

import math
import os
import re
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from .sequence import FrameSequence, SequenceError, SequenceMesh
from .topology import FACE_NAMES, checked_faces, faces_of_file

SUFFIXES = (".npz", ".npy")
_MOST_COMPRESSED = 1 << 30  # bytes that are decompressed at once
_POSITION_NAMES = ("vertices", "positions", "points", "v")
_MOST_HEADER = 10_000  # as numpy accepts
_NAMED = re.compile(rf"(?:(.*)[_./])?({'|'.join(_POSITION_NAMES + FACE_NAMES)})", re.DOTALL)


@dataclass(frozen=True)
class _Stack:
    """An array in a file.

    Parameters
    ----------
    key : str
        Its name in an NPZ file; empty for NPY.
    shape : tuple of int
        As its header says.
    dtype : numpy.dtype
        As its header says.
    begin : int
        The first byte of its data, in the file, or in the member of the archive if it is compressed.
    compressed : bool
        Whether the member of the archive is compressed.
    fortran : bool
        Whether the first index varies fastest.
    """

    key: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    begin: int
    compressed: bool
    fortran: bool


class ArrayFile(FrameSequence):
    """Positions (frames, vertices, 3), and faces from the same NPZ file or another file.

    Parameters
    ----------
    path : Path
        An NPY or NPZ file.
    faces : Path or None
        A file with the faces, for arrays that come without.
    """

    def __init__(self, path: Path, faces: Path | None) -> None:
        self._path = path
        stacks = _stacks(path)
        for stack in stacks:
            if stack.dtype.hasobject:
                raise SequenceError(f"{_place(path, stack)}: holds Python objects, which are not loaded; save numbers")
        pairs = _pairs(path, stacks, faces is not None)
        lengths = {stack.shape[0] for stack, _ in pairs.values() if len(stack.shape) == 3}
        if len(lengths) != 1:
            what = "are for one frame" if not lengths else f"have {' and '.join(map(str, sorted(lengths)))} frames"
            raise SequenceError(f"{path}: its positions {what}; save arrays of shape (frames, vertices, 3)")
        self._stacks = [stack for stack, _ in pairs.values()]
        notes = [
            f"positions are {' and '.join(sorted({str(stack.dtype.newbyteorder('=')) for stack in self._stacks}))}"
        ]
        if any(stack.compressed for stack in self._stacks):
            notes.append(f"{path.name} is compressed: reading frames out of order decompresses it again")
        super().__init__(str(path), lengths.pop(), tuple(notes))
        self._meshes = tuple(
            SequenceMesh(name, self._faces(stack, of_faces, faces), stack.shape[-2])
            for name, (stack, of_faces) in pairs.items()
        )

    def _faces(self, stack: _Stack, of_faces: _Stack | None, file: Path | None) -> NDArray[np.uint32]:
        if of_faces is None:
            assert file is not None
            return faces_of_file(file, stack.shape[-2])
        _check_size(self._path, of_faces, math.prod(of_faces.shape) * of_faces.dtype.itemsize)
        with np.load(self._path, allow_pickle=False) as archive:
            return checked_faces(_place(self._path, of_faces), archive[of_faces.key], stack.shape[-2])

    def _read(self, index: int) -> tuple[str, tuple[SequenceMesh, ...], NDArray[np.float64]]:
        parts = [self._positions(stack, index if len(stack.shape) == 3 else 0) for stack in self._stacks]
        return f"{self._path.name}[{index}]", self._meshes, np.concatenate(parts)

    def _positions(self, stack: _Stack, index: int) -> NDArray[np.float64]:
        """(V, 3) of a frame."""
        if stack.fortran:
            if self._path.stat().st_size < stack.begin + math.prod(stack.shape) * stack.dtype.itemsize:
                raise SequenceError(f"{_place(self._path, stack)}: was cut off while it was read; check it again")
            whole: NDArray[Any] = np.memmap(self._path, stack.dtype, "r", stack.begin, stack.shape, "F")
            return np.array(whole[index] if len(stack.shape) == 3 else whole, np.float64)
        shape = stack.shape[-2:]
        size = math.prod(shape) * stack.dtype.itemsize
        _check_size(self._path, stack, size)
        file = self._file(stack)
        file.seek(stack.begin + index * size)
        data = file.read(size)
        if len(data) < size:
            raise SequenceError(f"{_place(self._path, stack)}: ends within frame {index}; copy or export it again")
        return np.frombuffer(data, stack.dtype).reshape(shape).astype(np.float64)

    def _file(self, stack: _Stack) -> IO[bytes]:
        key = f"file {stack.key if stack.compressed else ''}"
        if key not in self._opened:
            opened = (
                zipfile.ZipFile(self._path).open(f"{stack.key}.npy") if stack.compressed else open(self._path, "rb")
            )
            self._opened[key] = opened
        file: IO[bytes] = self._opened[key]
        return file


def _place(path: Path, stack: _Stack) -> str:
    return f"{path}: {stack.key}" if stack.key else str(path)


def _check_size(path: Path, stack: _Stack, size: int) -> None:
    """Raises SequenceError for bytes that a small file can only declare."""
    if stack.compressed and size > _MOST_COMPRESSED:
        raise SequenceError(
            f"{_place(path, stack)}: has {size >> 20:,} MiB in a frame, compressed; save it with numpy.savez"
        )


def _stacks(path: Path) -> list[_Stack]:
    """The arrays of a file; reads headers only."""
    if path.suffix.lower() == ".npy":
        with open(path, "rb") as file:
            return [_stack(path, "", file, os.fstat(file.fileno()).st_size, 0, False)]
    with open(path, "rb") as whole:
        if whole.read(2) != b"PK":
            raise SequenceError(f"{path}: is not an NPZ file (it does not begin with PK); save it with numpy.savez")
        with zipfile.ZipFile(whole) as archive:
            stacks = []
            for member in archive.infolist():
                if member.filename.endswith(".npy"):
                    compressed = member.compress_type != zipfile.ZIP_STORED
                    begin = 0
                    if not compressed:
                        whole.seek(member.header_offset + 26)
                        name, extra = np.frombuffer(whole.read(4), "<u2").tolist()
                        begin = member.header_offset + 30 + name + extra
                    with archive.open(member) as file:
                        key = member.filename.removesuffix(".npy")
                        stacks.append(_stack(path, key, file, member.file_size, begin, compressed))
            return stacks


def _stack(path: Path, key: str, file: IO[bytes], size: int, begin: int, compressed: bool) -> _Stack:
    version = np.lib.format.read_magic(file)
    if version != (1, 0):
        length = int.from_bytes(file.read(4), "little")
        if length > _MOST_HEADER:
            raise SequenceError(f"{path}: {key or 'it'} has a header of {length} bytes; save numbers only")
        file.seek(file.tell() - 4)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, fortran, dtype = read(file)
    stack = _Stack(key, shape, dtype, begin + file.tell(), compressed, bool(fortran))
    expected = file.tell() + math.prod(shape) * dtype.itemsize
    if not dtype.hasobject and size < expected:
        raise SequenceError(
            f"{_place(path, stack)}: is cut off: it has {size} of {expected} bytes; copy or export it again"
        )
    return stack


def _pairs(path: Path, stacks: list[_Stack], faces_given: bool) -> dict[str, tuple[_Stack, _Stack | None]]:
    """Positions and faces of each mesh, sorted by name."""
    positions: dict[str, _Stack] = {}
    faces: dict[str, _Stack] = {}
    for stack in stacks:
        if path.suffix.lower() == ".npy":
            positions[path.stem] = stack
        elif match := _NAMED.fullmatch(stack.key):
            kind = positions if match[2] in _POSITION_NAMES else faces
            name = match[1] or path.stem
            if name in kind:
                raise SequenceError(f"{path}: has both {kind[name].key} and {stack.key}; keep one of them")
            kind[name] = stack
    if not positions:
        found = ", ".join(stack.key for stack in stacks) or "nothing"
        raise SequenceError(
            f"{path}: has no positions; name the array {_POSITION_NAMES[0]}, or NAME_vertices (it has: {found[:100]})"
        )
    for stack in positions.values():
        _check_positions(path, stack)
    if faces_given:
        if faces:
            raise SequenceError(f"{path}: has faces of its own; leave out faces (--faces)")
        if len(positions) > 1:
            raise SequenceError(f"{path}: has {len(positions)} meshes; save their faces in it, as NAME_faces")
        return {name: (stack, None) for name, stack in positions.items()}
    if len(positions) == len(faces) == 1:
        return dict(zip(positions, zip(positions.values(), faces.values(), strict=True), strict=True))
    for name, stack in positions.items():
        if name not in faces:
            remedy = "give faces (--faces FILE)" if len(positions) == 1 else f"save {name}_faces"
            raise SequenceError(f"{_place(path, stack)}: has no faces; {remedy}")
    return {name: (positions[name], faces[name]) for name in sorted(positions)}


def _check_positions(path: Path, stack: _Stack) -> None:
    place = _place(path, stack)
    if len(stack.shape) not in (2, 3) or stack.shape[-1] != 3:
        raise SequenceError(f"{place}: has the shape {stack.shape}; save positions as (frames, vertices, 3)")
    if stack.dtype.kind != "f" or stack.dtype.itemsize > 8:
        raise SequenceError(f"{place}: holds {stack.dtype}; save float16, float32 or float64")
    if stack.fortran and stack.compressed:
        raise SequenceError(f"{place}: is compressed in Fortran order; save numpy.ascontiguousarray of it")
