# SPDX-License-Identifier: Apache-2.0
"""Wavefront OBJ: the lines v and f. All others are about appearance, or are lines, points and curves."""

import re

import numpy as np
from numpy.typing import NDArray

from . import lines
from .errors import MeshFileError
from .polygons import Polygons


def parse(data: bytes) -> Polygons:
    """Positions as the lines v number them, and the polygons of the lines f. Raises MeshFileError."""
    reader = _Reader()
    for chunk in lines.chunks(data, len(lines.BOM) if data.startswith(lines.BOM) else 0):
        if not reader.read_alike(chunk):
            reader.read(chunk)
    return reader.polygons()


def faces_begin(data: bytes) -> int:
    """The line end before the first face, if no vertex follows it; otherwise the length of the file."""
    begin = data.find(b"\nf ")
    return len(data) if begin < 0 or re.search(rb"[\r\n]\s*v\s", data[begin:]) else begin


def with_faces_of(head: bytes, last: Polygons) -> Polygons | None:
    """Positions in the part of a file before its faces, with the faces of a file that ends with the same bytes.

    None if the faces could be others.
    """
    if head.endswith((b"\\", b"\\\r")):  # the first face continues this line
        return None
    found = parse(head)
    if len(found.counts) or len(found.vertices) != len(last.vertices):
        return None
    return Polygons(found.vertices, last.corners, last.counts)


class _Reader:
    """Makes arrays chunk by chunk: converting a list of the whole file would be one long call."""

    def __init__(self) -> None:
        self._line = 0
        self._pending = b""  # beginning of a line that continues on the next one
        self._n_vertices = 0
        self._positions = [np.empty((0, 3))]
        self._corners = [np.empty(0, np.int64)]
        self._faces = [np.empty((3, 0), np.int64)]  # rows: number of corners, largest corner, line

    def read_alike(self, chunk: list[bytes]) -> bool:
        """Read lines that are all vertices of three numbers, or all triangles, as most of a large file is.

        Returns False, having read nothing, if they are not.
        """
        joined, n = b" ".join(chunk), len(chunk)
        if b"_" in joined:  # in a name, or in a word that only Python takes for a number
            return False
        words = joined.split()
        if self._pending or len(words) != 4 * n or words[0] not in (b"v", b"f") or words[::4] != [words[0]] * n:
            return False
        is_vertices = words[0] == b"v"
        del words[::4]
        try:
            if is_vertices:
                self._add(list(map(float, words)), [], [])
            else:
                corners = np.array([int(word.partition(b"/")[0]) for word in words], np.int64).reshape(-1, 3)
                if corners.min() <= 0:
                    return False
                numbers = np.arange(self._line + 1, self._line + 1 + n)
                self._corners.append(corners.reshape(-1) - 1)
                self._faces.append(np.stack([np.full(n, 3), corners.max(axis=1), numbers]))
        except (ValueError, OverflowError):
            return False  # `read` reports the line
        self._line += n
        return True

    def read(self, chunk: list[bytes]) -> None:
        """Read any lines. Raises MeshFileError."""
        coordinates: list[float] = []
        corners: list[int] = []
        faces: list[tuple[int, int, int]] = []
        for line in chunk:
            self._line += 1
            if self._pending:
                line, self._pending = self._pending + b" " + line, b""
            words = line.split()
            if not words or words[0] not in (b"v", b"f"):
                continue
            if b"#" in line or b"\\" in line or b"_" in line:
                line = line.partition(b"#")[0].rstrip()
                # Only for v and f: a comment or a name that ends with a backslash must not swallow the next vertex.
                if line.endswith(b"\\"):
                    self._pending = line[:-1]
                    continue
                words = lines.words(line)
            try:
                if words[0] == b"v":
                    _, x, y, z = words[:4]  # a weight or a colour may follow
                    coordinates += (float(x), float(y), float(z))
                elif len(words) > 3:  # otherwise a point or a line
                    face = _face(words, self._n_vertices + len(coordinates) // 3)
                    corners += face
                    faces.append((len(face), max(face), self._line))
            except ValueError:
                what = "a vertex and three numbers" if words[0] == b"v" else "a face and the numbers of its vertices"
                raise MeshFileError(
                    f"line {self._line}: {lines.shown(b' '.join(words))}: expected {what}; export it again"
                ) from None
        self._add(coordinates, corners, faces)

    def _add(self, coordinates: list[float], corners: list[int], faces: list[tuple[int, int, int]]) -> None:
        self._positions.append(np.array(coordinates, np.float64).reshape(-1, 3))
        self._n_vertices += len(self._positions[-1])
        self._corners.append(np.array(corners, np.int64) - 1)
        self._faces.append(np.array(faces, np.int64).reshape(-1, 3).T)

    def polygons(self) -> Polygons:
        """All polygons read. Raises MeshFileError."""
        if self._pending:
            line, self._pending = self._pending, b""
            self.read([line])
        counts, largest, numbers = np.concatenate(self._faces, axis=1)
        if (beyond := np.flatnonzero(largest > self._n_vertices)).size:
            number, vertex = numbers[beyond[0]], largest[beyond[0]]
            raise MeshFileError(
                f"line {number}: names vertex {vertex}, and the file has {self._n_vertices}; copy or export it again"
            )
        return Polygons(np.concatenate(self._positions), np.concatenate(self._corners), counts)


def _face(words: list[bytes], n_vertices: int) -> list[int]:
    """The vertices of a face, counted from 1. Raises ValueError."""
    corners = [int(word.partition(b"/")[0]) for word in words[1:]]
    if min(corners) <= 0:
        if 0 in corners:
            raise ValueError("vertices count from 1")
        # Negative numbers count backwards from the last vertex above the line.
        corners = [corner if corner > 0 else n_vertices + corner + 1 for corner in corners]
        if min(corners) <= 0:
            raise ValueError("no such vertex")
    if max(corners) >= 2**62:
        raise ValueError("no such vertex")
    return corners


def triangles(polygons: Polygons) -> NDArray[np.int64]:
    """Triangles in the order of the file; if it has only quads, first one triangle of each, then the other."""
    faces = polygons.triangles()
    second = polygons.second_of_quads()
    if not second.any():
        return faces
    faces[second] = np.roll(faces[second], -1, axis=1)
    return np.concatenate([faces[~second], faces[second]]) if (polygons.counts == 4).all() else faces
