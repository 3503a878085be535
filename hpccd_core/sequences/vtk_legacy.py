# SPDX-License-Identifier: Apache-2.0
"""Legacy VTK files of the data sets POLYDATA and UNSTRUCTURED_GRID, ASCII and binary."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .sequence import SequenceError

_TYPES = {
    "float": ">f4",
    "double": ">f8",
    "int": ">i4",
    "unsigned_int": ">u4",
    "long": ">i8",
    "vtktypeint32": ">i4",
    "vtktypeint64": ">i8",
    "vtkidtype": ">i4",
}
_HEADER = re.compile(rb"# vtk DataFile[^\n]*\n[^\n]*\n\s*(ASCII|BINARY)\s+DATASET\s+(\w+)[^\n]*\n", re.IGNORECASE)
_LONGEST_NUMBER, _MOST_SECTIONS = 100, 100
POLYGON = 7  # cell type of VTK


@dataclass(frozen=True)
class Cells:
    """Points and cells.

    Parameters
    ----------
    points : (n, 3) float64
        Positions.
    corners : (sum of counts,) int64
        The points of each cell, one cell after the other.
    counts : (C,) int64
        The number of corners of each cell.
    types : (C,) int64
        VTK's number of the type of each cell.
    """

    points: NDArray[np.float64]
    corners: NDArray[np.int64]
    counts: NDArray[np.int64]
    types: NDArray[np.int64]


def parse(path: Path, data: bytes) -> Cells:
    """The polygons of POLYDATA, or all cells of an unstructured grid; attributes are ignored.

    Raises
    ------
    SequenceError
        The file is cut off or damaged, has another data set, or triangle strips.
    """
    header = _HEADER.match(data)
    if header is None:
        raise SequenceError(f"{path}: is not a legacy VTK file (its header is different); export it again")
    name = header[2].decode().upper()
    if name not in ("POLYDATA", "UNSTRUCTURED_GRID"):
        raise SequenceError(f"{path}: holds the data set {name}; extract its surface as POLYDATA")
    return _Reader(path, data, header.end(), header[1].upper() == b"BINARY").parse()


class _Reader:
    def __init__(self, path: Path, data: bytes, begin: int, binary: bool) -> None:
        self._path, self._data, self._at, self._binary = path, data, begin, binary

    def parse(self) -> Cells:
        points, corners, counts = np.empty((0, 3)), np.empty(0, np.int64), np.empty(0, np.int64)
        types: NDArray[np.int64] | None = None
        sections: list[str] = []
        while words := self._words():
            sections.append(words[0].upper())
            if sections.count(sections[-1]) > _MOST_SECTIONS:  # each is a copy of the rest of an ASCII file
                raise SequenceError(f"{self._path}: has too many sections {words[0][:40]!r}; export it again")
            match [words[0].upper(), *words[1:]]:
                case ["POINTS", n, kind]:
                    points = self._array(3 * int(n), kind).astype(np.float64).reshape(-1, 3)
                case ["POLYGONS" | "CELLS", n, size]:
                    corners, counts = self._cells(int(n), int(size))
                case ["CELL_TYPES", n]:
                    types = self._array(int(n), "int").astype(np.int64)
                case ["VERTICES" | "LINES", n, size]:
                    self._cells(int(n), int(size))
                case ["METADATA"]:
                    end = self._data.find(b"\n\n", self._at)
                    self._at = len(self._data) if end < 0 else end + 2
                case ["CELL_DATA" | "POINT_DATA", *_]:
                    break
                case ["FIELD", _, n]:
                    self._skip_fields(int(n))
                case ["TRIANGLE_STRIPS", *_]:
                    raise SequenceError(f"{self._path}: has triangle strips; convert them to triangles")
                case _:
                    raise SequenceError(f"{self._path}: has an unknown section {words[0][:40]!r}; export it again")
        if types is None:
            types = np.full(len(counts), POLYGON)
        # Each by itself first: their sum may overflow.
        if ((counts < 0) | (counts > len(corners))).any() or counts.sum() != len(corners):
            raise SequenceError(
                f"{self._path}: the numbers of corners of its cells do not add up to {len(corners)}; export it again"
            )
        if len(types) != len(counts):
            raise SequenceError(f"{self._path}: has {len(types)} types of {len(counts)} cells; export it again")
        return Cells(points, corners, counts, types)

    def _skip_fields(self, n: int) -> None:
        if n > _MOST_SECTIONS:
            raise SequenceError(f"{self._path}: has {n} fields; export it with at most {_MOST_SECTIONS}, or without")
        for _ in range(n):
            _, width, height, kind = self._words()[:4]
            self._array(int(width) * int(height), kind)

    def _words(self) -> list[str]:
        """Those of the next line that is not empty; none at the end."""
        while self._at < len(self._data):
            end = self._data.find(b"\n", self._at)
            end = len(self._data) if end < 0 else end
            words = self._data[self._at : min(end, self._at + 200)].decode("latin-1").split()
            self._at = end + 1
            if words:
                return words
        return []

    def _cells(self, n: int, size: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(corners, counts). Since version 5, sizes are those of the two arrays OFFSETS and CONNECTIVITY."""
        if min(n, size) < 0 or max(n, size) > len(self._data):
            raise self._cut_off()
        begin = self._at
        words = self._words()
        if words and words[0].upper() == "OFFSETS":
            offsets = self._array(n, words[-1]).astype(np.int64)
            return self._array(size, self._words()[-1]).astype(np.int64), np.diff(offsets)
        self._at = begin
        numbers = self._array(size, "int").astype(np.int64)
        counts, at = np.empty(n, np.int64), 0
        if n and size == n * (numbers[0] + 1) and (numbers[:: numbers[0] + 1] == numbers[0]).all():
            return numbers.reshape(n, -1)[:, 1:].reshape(-1), np.full(n, numbers[0])
        kept = np.ones(size, bool)
        for k in range(n):
            counts[k] = numbers[at]
            kept[at] = False
            at += 1 + int(counts[k])
        return numbers[kept], counts

    def _array(self, n: int, kind: str) -> NDArray[Any]:
        dtype = np.dtype(_TYPES.get(kind.lower(), "V"))
        if dtype.kind == "V":
            raise SequenceError(f"{self._path}: has numbers of type {kind[:40]}; export float or double, and int")
        if not 0 <= n <= len(self._data):
            raise self._cut_off()
        if self._binary:
            end = self._at + n * dtype.itemsize
            if end > len(self._data):
                raise self._cut_off()
            found: NDArray[Any] = np.frombuffer(self._data, dtype, n, self._at)
            self._at = end
            return found
        words = self._data[self._at :].split(None, n)
        if len(words) < n:
            raise self._cut_off()
        if max(map(len, words[:n]), default=0) > _LONGEST_NUMBER:  # an array has the width of its longest word
            raise SequenceError(
                f"{self._path}: has a word of more than {_LONGEST_NUMBER} characters among its numbers; export it again"
            )
        self._at = len(self._data) - len(words[n]) if len(words) > n else len(self._data)
        return np.array(words[:n]).astype(dtype.newbyteorder("="))

    def _cut_off(self) -> SequenceError:
        return SequenceError(f"{self._path}: is cut off: it ends within an array; copy or export it again")
