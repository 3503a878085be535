# SPDX-License-Identifier: Apache-2.0
"""PLY, ASCII and binary: positions of the element vertex, polygons of the element face."""

import dataclasses
import math
import struct
from collections.abc import Iterator
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import lines
from .errors import MeshFileError
from .polygons import Polygons

_TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}
_BYTE_ORDERS: dict[str, Literal["=", "<", ">"]] = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
_CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "i8": "q", "u8": "Q", "f4": "f", "f8": "d"}
_LISTS_OF_VERTICES = ("vertex_indices", "vertex_index")


@dataclasses.dataclass
class _Property:
    name: str
    type: np.dtype[Any]
    count_type: np.dtype[Any] | None  # type of the length of a list; None: not a list


@dataclasses.dataclass
class _Element:
    name: str
    count: int
    properties: list[_Property]

    def has_lists(self) -> bool:
        return any(p.count_type is not None for p in self.properties)

    def columns(self) -> list[int]:
        """The places of x, y and z among the properties."""
        names = [p.name for p in self.properties]
        return [names.index(axis) for axis in "xyz"]


def parse(data: bytes) -> Polygons:
    """Positions and polygons as the file numbers them; other elements and properties are ignored.

    Raises MeshFileError.
    """
    form, elements, body = _header(data)
    names = [element.name for element in elements]
    if "vertex" not in names or not {"x", "y", "z"} <= {p.name for p in elements[names.index("vertex")].properties}:
        raise MeshFileError("has no element vertex with the properties x, y and z; export it again")
    _check_coordinates(elements[names.index("vertex")])
    if "face" not in names:
        strips = "; it holds triangle strips: convert it to faces" if "tristrips" in names else ""
        raise MeshFileError(f"has no triangles (no element face){strips}")
    rows = _Text(data, body) if form == "ascii" else _Bytes(data, body, _BYTE_ORDERS[form])
    vertices: NDArray[np.float64] = np.empty((0, 3))
    corners = counts = np.empty(0, np.int64)
    for element in elements[: 1 + max(names.index("vertex"), names.index("face"))]:
        if not element.count:
            continue
        if element.name == "vertex":
            vertices = rows.positions(element)
        elif element.name == "face":
            counts, corners = rows.polygons(element, _list_of_vertices(element))
        else:
            rows.skip(element)
    bad = np.flatnonzero((corners < 0) | (corners >= len(vertices)))
    if bad.size:
        face = int(np.searchsorted(np.cumsum(counts), bad[0], side="right"))
        raise MeshFileError(
            f"face {face} names vertex {corners[bad[0]]}, and the file has {len(vertices)}; export it again"
        )
    large = counts >= 3  # others are points and lines
    return Polygons(vertices, corners[np.repeat(large, counts)], counts[large])


def triangles(polygons: Polygons) -> NDArray[np.int64]:
    """The triangles of the file, then the first ones of quads, then the second ones, then those of larger polygons."""
    faces = polygons.triangles()
    if (polygons.counts == 3).all():
        return faces
    corners, second = np.repeat(polygons.counts, polygons.counts - 2), polygons.second_of_quads()
    faces[second] = np.roll(faces[second], -1, axis=1)
    groups = corners == 3, (corners == 4) & ~second, second, corners > 4
    return np.concatenate([faces[group] for group in groups])


def _header(data: bytes) -> tuple[str, list[_Element], int]:
    """(format, elements, where the body begins)."""
    form, elements, at = "", [], 0
    for number in range(1, 10_000):
        end = min((e for e in (data.find(b"\n", at), data.find(b"\r", at)) if e >= 0), default=-1)
        if end < 0:
            break
        line = data[at:end]
        at = end + 2 if data[end : end + 2] == b"\r\n" else end + 1
        words = line.decode("latin-1").split()
        match words:
            case ["ply"] if number == 1:
                pass
            case _ if number == 1:
                raise MeshFileError("is not a PLY file (it does not begin with ply); export it again")
            case [] | ["comment" | "obj_info", *_]:
                pass
            case ["format", name, _] if name in _BYTE_ORDERS:
                form = name
            case ["element", name, count] if count.isdecimal() and len(count) < 16:
                elements.append(_Element(name, int(count), []))
            case ["property", "list", count, item, name] if elements and count in _TYPES and item in _TYPES:
                elements[-1].properties.append(_property(name, item, count))
            case ["property", item_type, name] if elements and item_type in _TYPES:
                elements[-1].properties.append(_property(name, item_type, None))
            case ["end_header"] if form:
                return form, elements, at
            case _:
                raise MeshFileError(f"line {number}: {lines.shown(line)}: not a line of a PLY header; export it again")
    raise MeshFileError("its header does not end (end_header is missing); copy or export it again")


def _property(name: str, item_type: str, count_type: str | None) -> _Property:
    return _Property(name, np.dtype(_TYPES[item_type]), np.dtype(_TYPES[count_type]) if count_type else None)


def _check_coordinates(element: _Element) -> None:
    """Raises MeshFileError where a coordinate of the vertices is a list."""
    for column in element.columns():
        if element.properties[column].count_type is not None:
            name = element.properties[column].name
            raise MeshFileError(f"property {name} of its vertices is a list; export it again with single numbers")


def _list_of_vertices(element: _Element) -> int:
    """The number of the property of the faces that lists their vertices."""
    lists = [k for k, p in enumerate(element.properties) if p.count_type is not None]
    named = [k for k in lists if element.properties[k].name in _LISTS_OF_VERTICES]
    if named or len(lists) == 1:
        return (named or lists)[0]
    raise MeshFileError("its faces have no list vertex_indices; export it again")


def _cut_off(element: _Element) -> MeshFileError:
    rows = f"{element.count} rows of {element.name}"
    return MeshFileError(f"is cut off: it ends before the last of its {rows}; copy or export it again")


class _Text:
    """The rows of an ASCII body, one per line. Words after the last property of a line are ignored."""

    def __init__(self, data: bytes, body: int) -> None:
        self._rows = self._of(data, body)

    @staticmethod
    def _of(data: bytes, body: int) -> Iterator[tuple[int, bytes]]:
        number = len(data[:body].splitlines())
        for chunk in lines.chunks(data, body):
            for line in chunk:
                number += 1
                if not line.isspace() and line:
                    yield number, line

    def _next(self, element: _Element) -> tuple[int, bytes]:
        row = next(self._rows, None)
        if row is None:
            raise _cut_off(element)
        return row

    def skip(self, element: _Element) -> None:
        for _ in range(element.count):
            self._next(element)

    def positions(self, element: _Element) -> NDArray[np.float64]:
        found = [np.empty((0, 3))]
        columns = element.columns()
        for part in _parts(element.count):
            xyz = []
            for _ in part:
                number, line = self._next(element)
                words = lines.words(line)
                places = _places(element, words, number, line) if element.has_lists() else None
                try:
                    xyz.append([float(words[places[column] if places else column]) for column in columns])
                except (ValueError, IndexError):
                    raise _unusable(number, line) from None
            found.append(np.array(xyz))
        together = np.concatenate(found)
        for axis, column in enumerate(columns):
            if (of := element.properties[column].type).kind == "f":
                with np.errstate(over="ignore"):  # the result is infinite, which the loader rejects
                    together[:, axis] = together[:, axis].astype(of)  # as a binary file would hold it
        return together

    def polygons(self, element: _Element, which: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        found, counts = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
        for part in _parts(element.count):
            corners: list[int] = []
            sizes: list[int] = []
            for _ in part:
                number, line = self._next(element)
                words = lines.words(line)
                place = _places(element, words, number, line)[which]
                try:
                    indices = [_integer(word) for word in words[place + 1 : place + 1 + _integer(words[place])]]
                except ValueError:
                    raise _unusable(number, line) from None
                corners += indices
                sizes.append(len(indices))
            found.append(np.array(corners, np.int64))
            counts.append(np.array(sizes, np.int64))
        return np.concatenate(counts), np.concatenate(found)


def _parts(count: int) -> Iterator[range]:
    """Ranges of rows, few at a time, so that no call converts all of them."""
    return (range(start, min(start + 10_000, count)) for start in range(0, count, 10_000))


def _places(element: _Element, words: list[bytes], number: int, line: bytes) -> list[int]:
    """The word at which each property of the row begins; a list begins with its length."""
    places, at = [], 0
    try:
        for one in element.properties:
            places.append(at)
            at += 1 if one.count_type is None else 1 + max(0, _integer(words[at]))
    except (ValueError, IndexError):
        raise _unusable(number, line) from None
    if at > len(words):
        raise _unusable(number, line)
    return places


def _integer(word: bytes) -> int:
    """The word as an integer. Some programs write the list of vertices as float."""
    try:
        integer = int(word)
    except ValueError:
        if not (number := float(word)).is_integer():
            raise
        integer = int(number)
    if not -(2**62) < integer < 2**62:
        raise ValueError
    return integer


def _unusable(number: int, line: bytes) -> MeshFileError:
    return MeshFileError(
        f"line {number}: {lines.shown(line)}: does not have the values that the header lists; export it again"
    )


class _Bytes:
    """The rows of a binary body."""

    def __init__(self, data: bytes, body: int, order: Literal["=", "<", ">"]) -> None:
        self._data = data
        self._at = body
        self._order = order

    def skip(self, element: _Element) -> None:
        if element.properties and self._uniform(element) is None:
            self._ragged(element, -1)

    def positions(self, element: _Element) -> NDArray[np.float64]:
        rows = self._uniform(element)
        columns = element.columns()
        if rows is not None:
            return np.stack([rows[str(column)].astype(np.float64) for column in columns], axis=1)
        octets, start, axes = np.frombuffer(self._data, np.uint8), self._at, []
        for column in columns:
            self._at = start
            offsets, _ = self._ragged(element, column)
            item = element.properties[column].type.newbyteorder(self._order)
            places = offsets[:, None] + np.arange(item.itemsize)
            axes.append(octets[places].view(item)[:, 0].astype(np.float64))
        return np.stack(axes, axis=1)

    def polygons(self, element: _Element, which: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        item = element.properties[which].type.newbyteorder(self._order)
        rows = self._uniform(element)
        if rows is not None:
            indices = rows[str(which)]
            return np.full(len(rows), indices.shape[1], np.int64), _integers(indices).reshape(-1)
        offsets, counts = self._ragged(element, which)
        starts = np.cumsum(counts) - counts
        corners = np.empty(int(counts.sum()), np.int64)
        octets = np.frombuffer(self._data, np.uint8)
        for count in np.unique(counts):
            of_size = np.flatnonzero(counts == count)
            for part in _parts(len(of_size)):
                these = of_size[part.start : part.stop]
                places = offsets[these, None] + np.arange(count * item.itemsize)
                corners[starts[these, None] + np.arange(count)] = _integers(octets[places].view(item))
        return counts, corners

    def _uniform(self, element: _Element) -> NDArray[Any] | None:
        """All rows as one structured array; moves on. None if lists differ in length from row to row."""
        fields: list[tuple[str, np.dtype[Any], tuple[int, ...]]] = []
        lengths: dict[str, int] = {}
        at = self._at
        for k, one in enumerate(element.properties):
            if one.count_type is not None:
                count_type = one.count_type.newbyteorder(self._order)
                lengths[f"n{k}"] = length = self._length(element, at, count_type)
                fields.append((f"n{k}", count_type, ()))
                at += count_type.itemsize + length * one.type.itemsize
            else:
                length = -1
                at += one.type.itemsize
            if at > len(self._data):
                raise _cut_off(element)
            fields.append((str(k), one.type.newbyteorder(self._order), () if length < 0 else (length,)))
        row = np.dtype(fields)
        if self._at + element.count * row.itemsize > len(self._data):
            if not lengths:
                raise _cut_off(element)
            return None
        rows = np.frombuffer(self._data, row, element.count, self._at)
        if any((rows[name] != length).any() for name, length in lengths.items()):
            return None
        self._at += element.count * row.itemsize
        return rows

    def _length(self, element: _Element, at: int, of: np.dtype[Any]) -> int:
        if at + of.itemsize > len(self._data):
            raise _cut_off(element)
        return _checked_length(np.frombuffer(self._data, of, 1, at)[0])

    def _ragged(self, element: _Element, which: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(first byte, length) of the property ``which`` of each row; moves on. A number has length 1."""
        # Bytes to skip, type of the length, bytes of an item, whether it is the property ``which``.
        steps: list[tuple[int, struct.Struct | None, int, bool]] = []
        before = 0  # bytes of the numbers before a list, or before the property
        for k, one in enumerate(element.properties):
            if one.count_type is not None:
                counter = struct.Struct(self._order + _CODES[one.count_type.str[1:]])
                steps.append((before, counter, one.type.itemsize, k == which))
                before = 0
            elif k == which:
                steps.append((before, None, one.type.itemsize, True))
                before = 0
            else:
                before += one.type.itemsize
        offsets, counts = [], []
        data, at = self._data, self._at
        try:
            for _ in range(element.count):
                for skipped, length, size, wanted in steps:
                    at += skipped
                    count = 1
                    if length is not None:
                        count = _checked_length(length.unpack_from(data, at)[0])
                        at += length.size
                    if wanted:
                        offsets.append(at)
                        counts.append(count)
                    at += count * size
                    if at > len(data):
                        raise _cut_off(element)
                at += before
        except struct.error:
            raise _cut_off(element) from None
        if at > len(data):
            raise _cut_off(element)
        self._at = at
        return np.array(offsets, np.int64), np.array(counts, np.int64)


def _checked_length(number: float) -> int:
    if not (math.isfinite(number) and number >= 0 and number == int(number)):
        raise MeshFileError(f"is damaged: it has a list of length {number}; copy or export it again")
    return int(number)


def _integers(indices: NDArray[Any]) -> NDArray[np.int64]:
    """The indices as integers. Some programs write the list of vertices as float."""
    with np.errstate(invalid="ignore"):
        integers: NDArray[np.int64] = indices.astype(np.int64)
    if indices.dtype.kind == "f" and (integers != indices).any():
        raise MeshFileError("a face names a vertex by a number that is not whole; export it again")
    return integers
