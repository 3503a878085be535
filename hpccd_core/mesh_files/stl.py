# SPDX-License-Identifier: Apache-2.0
"""STL, binary and ASCII: triangles that share no corners."""

import numpy as np
from numpy.typing import NDArray

from . import lines
from .errors import MeshFileError

_HEADER = 84  # bytes: 80 of any content, and the number of triangles
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def is_binary(data: bytes) -> bool:
    """Whether its length matches its number of triangles: then it is binary, whatever its header looks like."""
    return len(data) >= _HEADER and len(data) == _HEADER + _TRIANGLE.itemsize * _count(data)


def fits(data: bytes) -> bool:
    """Whether it is large enough for its number of triangles. In a text file that number is hundreds of millions."""
    return len(data) >= _HEADER and 0 < _count(data) <= (len(data) - _HEADER) // _TRIANGLE.itemsize


def parse(data: bytes) -> NDArray[np.float64]:
    """(3 F, 3) the corners of F triangles, one after the other. Raises MeshFileError."""
    if is_binary(data):
        return _of_binary(data)
    # Names and comments may have any encoding, but no text contains a zero byte.
    if b"\0" not in data and b"facet" in data[:10_000].lower():
        return _of_text(data)
    if len(data) < _HEADER or not _count(data):
        raise MeshFileError(
            "is neither a binary STL (its length does not fit its number of triangles) nor an ASCII "
            "STL; export it again"
        )
    room = (len(data) - _HEADER) // _TRIANGLE.itemsize
    if _count(data) > room:
        raise MeshFileError(
            f"is neither an ASCII STL nor a whole binary STL: it declares {_count(data)} triangles but contains {room}"
            "; copy or export it again"
        )
    return _of_binary(data)


def _count(data: bytes) -> int:
    return int.from_bytes(data[_HEADER - 4 : _HEADER], "little")


def _of_binary(data: bytes) -> NDArray[np.float64]:
    """Ignores bytes after the last triangle: some programs write their own data there."""
    triangles = np.frombuffer(data, _TRIANGLE, count=_count(data), offset=_HEADER)
    return triangles["corners"].astype(np.float64).reshape(-1, 3)


def _of_text(data: bytes) -> NDArray[np.float64]:
    """Each facet has three `vertex` lines. `endsolid` may be missing, but the last `endfacet` may not, because the
    number before it could be cut off."""
    found = [np.empty(0)]
    number, facets, corners = 0, 0, 0  # corners of the current facet: 3 if it is complete
    whole = True
    for chunk in lines.chunks(data):
        coordinates: list[float] = []
        for line in chunk:
            number += 1
            words = lines.words(line)
            key = words[0].lower() if words else b""
            if key == b"vertex":
                if len(words) != 4:
                    raise MeshFileError(
                        f"line {number}: {lines.shown(line)}: expected vertex and three numbers; export it again"
                    )
                try:
                    coordinates += [float(words[1]), float(words[2]), float(words[3])]
                except ValueError:
                    raise MeshFileError(
                        f"line {number}: {lines.shown(line)}: contains a word that is not a number; export it again"
                    ) from None
                corners += 1
            elif key in (b"facet", b"endfacet", b"endsolid"):
                if corners != 3 and facets:
                    raise MeshFileError(
                        f"line {number}: the facet before it has {corners} vertices, not 3; export it again"
                    )
                if key == b"facet":
                    facets, corners = facets + 1, 0
                whole = key != b"facet"
        found.append(np.array(coordinates, np.float64))
    points = np.concatenate(found).reshape(-1, 3)
    if not whole or len(points) != 3 * facets:
        raise MeshFileError(
            f"is cut off or damaged: it has {facets} facets and {len(points)} vertices; copy or export it again"
        )
    return points
