# SPDX-License-Identifier: Apache-2.0
"""One loader for all mesh files."""

import contextlib
import dataclasses
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..arguments import LARGEST_COORDINATE
from . import collada, contents, obj, ply, stl
from .errors import MeshFileError, shortened
from .polygons import Polygons
from .welding import joined

FORMATS = (".obj", ".ply", ".stl", ".dae")


def load_mesh(path: str | os.PathLike[str]) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """Read a mesh file, with its vertices numbered as in the file.

    Parameters
    ----------
    path : str or os.PathLike
        An OBJ, PLY, STL or COLLADA (DAE) file, told apart by suffix. ``~`` is the home folder.

    Returns
    -------
    vertices : (V, 3) float64
        Positions in the unit of the file; of DAE in metres. Vertices that no face uses are kept.
    faces : (F, 3) uint32
        Triangles, as three numbers of vertices each.

    Raises
    ------
    MeshFileError
        The file does not exist, is truncated, damaged or not a mesh, has no triangles, or needs a Python package that
        is not installed. The message names the file, the problem and the remedy.
    TypeError
        path is neither a string nor an os.PathLike of one.

    Notes
    -----
    What each format contains, and what is ignored:

    - OBJ: all lines ``v``, in the order of the file. Ignored: materials, groups, objects, texture coordinates, normals,
      colours, weights, lines, curves, comments in any encoding, a byte order mark. Lines end with LF, CR LF or CR.
    - PLY (ASCII, binary of either byte order): all rows of the element ``vertex``, in single precision where the file
      says ``float``. Ignored: other properties, including lists of any type and length in any place; other elements;
      bytes after the last row.
    - STL (binary, ASCII): corners at equal positions are one vertex, in order of first use. Ignored: solids, names,
      normals, attributes, the content of the binary header, bytes after the last triangle, a missing ``endsolid``. A
      binary file whose header begins like an archive or another binary format is rejected if bytes follow its last
      triangle.
    - DAE: all positions of each geometry, in the order of the scene, in single precision, scaled to metres by
      ``<unit>`` and placed by the nodes of the scene, as RViz shows it. Ignored: materials, lines, ``<up_axis>`` (RViz
      ignores it too). Rejected: skinned geometry, polygons with holes (``<ph>``), positions that are not finite, counts
      that differ from the content.

    A polygon becomes the fan of its first corner if the fan covers exactly the polygon, which is so for every convex
    one. Other polygons are split by ear clipping in their best plane (package ``mapbox_earcut``, one version of it,
    because others split differently). Polygons without area become fans. A polygon that crosses itself is rejected if
    the triangles would not have its area, and so is one that is not convex and has more than 8,000 corners; about 3 in
    100 random polygons that cross themselves are not detected. A corner that a face names twice in a row gives a
    triangle without area, which is kept. Faces with one or two corners are ignored.

    Triangles are in the order of the polygons, with two exceptions: in an OBJ file that has only quads, and in PLY, the
    second triangles of all quads follow the first ones; in PLY, triangles come first and polygons with five or more
    corners last.

    Loading a large OBJ, PLY or STL file does not hold the interpreter lock for long, so other threads keep running. The
    XML of a DAE file is parsed in one call, which takes 0.3 s for a million triangles.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import hpccd_core as hc
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "square.obj"
    >>> _ = file.write_text("v 0 0 0\\nv 1 0 0\\nv 1 1 0\\nv 0 1 0\\nf 1 2 3 4\\n")
    >>> vertices, faces = hc.load_mesh(file)
    >>> vertices.shape
    (4, 3)
    >>> faces.tolist()
    [[0, 1, 2], [2, 3, 0]]
    """
    mesh = load_polygons(path)
    return mesh.polygons.vertices, mesh.faces()


@dataclasses.dataclass(frozen=True)
class MeshFile:
    """A mesh file before its polygons are split.

    Parameters
    ----------
    path : Path
        The file, for messages.
    polygons : Polygons
        Vertices and polygons as the file numbers them.
    split : callable
        Triangles of polygons, in the order of the file's format.
    tail : bytes
        The end of an OBJ file, from its first face on. A file with the same tail has the same faces.
    """

    path: Path
    polygons: Polygons
    split: Callable[[Polygons], NDArray[np.int64]] = Polygons.triangles
    tail: bytes = b""

    def faces(self, vertices: NDArray[np.float64] | None = None) -> NDArray[np.uint32]:
        """(F, 3) uint32: triangles. How polygons are split depends on positions; vertices: others than the file's."""
        polygons = self.polygons if vertices is None else dataclasses.replace(self.polygons, vertices=vertices)
        with _reading(self.path), _core.StandardArithmetic():
            return self.split(polygons).astype(np.uint32)


def load_polygons(path: str | os.PathLike[str], last: MeshFile | None = None) -> MeshFile:
    """As `load_mesh`, before polygons are split into triangles. last: a file that may have the same faces."""
    file = existing(path)
    with _reading(file), _core.StandardArithmetic():  # Python and numpy round in the mode of the thread
        data = file.read_bytes()
        if last is not None and last.tail and data.endswith(last.tail):
            polygons = obj.with_faces_of(data[: -len(last.tail)], last.polygons)
            if polygons is not None:
                _check(polygons.vertices, len(polygons.counts))
                return dataclasses.replace(last, path=file, polygons=polygons)
        polygons, split = _parse(data, file.suffix.lower())
    tail = data[obj.faces_begin(data) :] if file.suffix.lower() == ".obj" else b""
    return MeshFile(file, polygons, split, tail)


@contextlib.contextmanager
def _reading(file: Path) -> Iterator[None]:
    """Turns all errors into a MeshFileError that names the file."""
    try:
        yield
    except MeshFileError as error:
        raise MeshFileError(f"{shortened(file)}: {error}") from error
    except OSError as error:
        raise MeshFileError(f"{shortened(file)}: cannot be read: {error.strerror}; give another file") from error
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:  # damage that no other check found
        raise MeshFileError(f"{shortened(file)}: is damaged: {shortened(error)}; export it again") from error


def existing(path: str | os.PathLike[str]) -> Path:
    """The file with this path, which has one of the suffixes in FORMATS.

    Raises MeshFileError if the suffix is another one or the file does not exist, TypeError if it is not a path.
    """
    name = os.fspath(path) if isinstance(path, os.PathLike) else path
    if not isinstance(name, str):
        raise TypeError(f'path: expected a string or os.PathLike, got {type(name).__name__}; write "mesh.obj"')
    shown = shortened(name)
    if (suffix := Path(name).suffix).lower() not in FORMATS:
        raise MeshFileError(f"{shown}: format {shortened(suffix) or '(none)'!r}; use one of {', '.join(FORMATS)}")
    try:
        file = Path(name).expanduser()
        if file.is_file():
            return file
    except RuntimeError as error:  # ~name, and there is no such user
        raise MeshFileError(f"{shown}: no such home folder; give the whole path") from error
    except ValueError as error:  # a zero byte, before Python 3.13
        raise MeshFileError(f"{shown}: no such file; file names hold no zero bytes") from error
    except OSError as error:
        raise MeshFileError(f"{shown}: {error.strerror}; give the path of a file that can be read") from error
    raise MeshFileError(f"{shown}: no such file (relative paths start from {Path.cwd()})")


@np.errstate(invalid="ignore")  # converting a signalling NaN warns; `_check` rejects it
def _parse(data: bytes, suffix: str) -> tuple[Polygons, Callable[[Polygons], NDArray[np.int64]]]:
    # The header of a binary STL may contain anything. With bytes after the triangles, the file may be an archive.
    if not (suffix == ".stl" and stl.is_binary(data)):
        text = not (suffix == ".stl" and stl.fits(data))
        if what := contents.foreign(data, suffix, text):
            raise MeshFileError(what)
    match suffix:
        case ".stl":
            corners = stl.parse(data)
            _check(corners, len(corners))
            first, vertex_of = joined(corners)
            return _triangles(corners[first], vertex_of), Polygons.triangles
        case ".dae":
            vertices, faces = collada.parse(data)
            _check(vertices, len(faces))
            return _triangles(vertices, faces), Polygons.triangles
        case ".obj":
            polygons, triangles = obj.parse(data), obj.triangles
        case _:
            polygons, triangles = ply.parse(data), ply.triangles
    _check(polygons.vertices, len(polygons.counts))
    return polygons, triangles


def _triangles(vertices: NDArray[np.float64], corners: NDArray[np.integer[Any]]) -> Polygons:
    """All polygons are triangles."""
    return Polygons(vertices, corners.reshape(-1).astype(np.int64), np.full(corners.size // 3, 3, np.int64))


def _check(vertices: NDArray[np.float64], n_faces: int) -> None:
    """Raises MeshFileError if the core would reject the mesh."""
    if not n_faces:
        raise MeshFileError("has no triangles; export the surface, not only points or lines")
    if found := first_unusable(vertices):
        vertex, limits = found
        raise MeshFileError(f"vertex {vertex} is {vertices[vertex].tolist()}; coordinates must {limits}")


def first_unusable(vertices: NDArray[np.float64]) -> tuple[int, str] | None:
    """The first vertex whose coordinates the core would reject, and what coordinates must do; None: there is none."""
    # Two reductions, because they need no further array; NaN passes through both and compares false.
    if -LARGEST_COORDINATE <= float(vertices.min()) and float(vertices.max()) <= LARGEST_COORDINATE:
        return None
    finite = np.isfinite(vertices).all(axis=1)
    limits = f"lie in [-{LARGEST_COORDINATE:g}, {LARGEST_COORDINATE:g}]" if finite.all() else "be finite"
    bad = np.abs(vertices).max(axis=1) > LARGEST_COORDINATE if finite.all() else ~finite
    return int(np.flatnonzero(bad)[0]), limits
