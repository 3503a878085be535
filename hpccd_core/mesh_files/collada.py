# SPDX-License-Identifier: Apache-2.0
"""Vertices and triangles of a COLLADA file (.dae), as RViz shows it: in metres, whatever axis the file calls up."""

import importlib
import io
import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import MeshFileError, shortened
from .polygons import Polygons

# Libraries and instances for appearance and animation. Broken references in them are common and do not matter here.
_LOOKS = (
    "library_images",
    "library_materials",
    "library_effects",
    "library_lights",
    "library_cameras",
    "library_animations",
    "library_animation_clips",
    "bind_material",
    "instance_light",
    "instance_camera",
    "extra",
)
# Nodes of a scene, each counted as often as it is instantiated: nodes that instantiate each other can make millions.
MOST_NODES = 100_000
_NOT_FINITE = "has a position that is not finite; export it again"


def parse(data: bytes) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """(vertices (n,3), faces (F,3)): positions as numbered in the file, geometry after geometry in the order of the
    scene, placed by its nodes and scaled by the file's unit.

    Raises MeshFileError.
    """
    try:
        collada: Any = importlib.import_module("collada")
    except ModuleNotFoundError:
        raise MeshFileError(
            "reading DAE files needs the Python package pycollada; install it with: pip install pycollada (it is part "
            "of the extra 'meshes')"
        ) from None
    try:
        return _parse(collada, data)
    except MeshFileError:
        raise
    except Exception as error:  # pycollada passes on any exception of its parsers
        why = shortened(" ".join(str(error).split())) or type(error).__name__
        raise MeshFileError(f"cannot be read: {why}") from error


def _parse(collada: Any, data: bytes) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    root = ElementTree.fromstring(data)
    if root.find(".//{*}instance_controller") is not None:
        raise MeshFileError("has geometry moved by a skeleton or morph (instance_controller); export it without that")
    _drop(root, _LOOKS)
    for mesh in root.iterfind(".//{*}mesh"):
        _check_positions(mesh)
        _check_faces(mesh)
    document = collada.Collada(io.BytesIO(ElementTree.tostring(root)))
    unit = _unit(document)
    if document.scene is None:
        raise MeshFileError("has no scene; export it again")
    vertices, faces, count = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], 0
    for geometry, matrix in _instances(collada, document.scene.nodes):
        offsets: dict[int, int] = {}  # by id of the array of positions, which several primitives may share
        for primitive in geometry.primitives:
            # Lines have no triangles; a primitive without corners has no positions either.
            if isinstance(primitive, collada.lineset.LineSet) or primitive.vertex is None:
                continue
            positions = primitive.vertex
            triangles = _triangles(collada, primitive)
            if id(positions) not in offsets:
                offsets[id(positions)] = count
                count += len(positions)
                placed = np.asarray(positions, np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
                vertices.append(placed * unit)
            faces.append(triangles + offsets[id(positions)])
    return np.concatenate(vertices), np.concatenate(faces)


def _drop(element: Any, names: tuple[str, ...]) -> None:
    for parent in element.iter():
        for child in [child for child in parent if str(child.tag).rpartition("}")[2] in names]:
            parent.remove(child)


def _check_positions(mesh: Any) -> None:
    """Raises MeshFileError if pycollada would misread the positions: it turns NaN into 0, and ignores count, stride and
    offset."""
    sources = {f"#{source.get('id')}": source for source in mesh.iterfind("{*}source")}
    for given in mesh.iterfind("{*}vertices/{*}input[@semantic='POSITION']"):
        source = sources.get(given.get("source"))
        array = None if source is None else source.find("{*}float_array")
        accessor = None if source is None else source.find("{*}technique_common/{*}accessor")
        if array is None or accessor is None:
            continue  # pycollada raises the error
        numbers = _numbers(array, np.float64)
        if not np.isfinite(numbers).all():
            raise MeshFileError(_NOT_FINITE)
        _check_count(array, "numbers", len(numbers))
        if int(accessor.get("stride", 1)) != len(accessor.findall("{*}param")) or int(accessor.get("offset", 0)):
            raise MeshFileError("has other numbers between its positions (stride or offset); export it again")


def _check_faces(mesh: Any) -> None:
    """Raises MeshFileError if pycollada would misread the faces: it ignores holes, count and all lists of triangles but
    the first one, and keeps 32 bits of each index."""
    if mesh.find(".//{*}ph") is not None:
        raise MeshFileError("has polygons with holes (ph); split them into triangles where the file was made")
    for kind in ("triangles", "polylist", "polygons"):
        for primitive in mesh.iterfind(f"{{*}}{kind}"):
            lists = primitive.findall("{*}p")
            width = 1 + max((int(given.get("offset", 0)) for given in primitive.iterfind("{*}input")), default=0)
            size = 0
            for numbers in (_numbers(one, np.int64) for one in lists):
                if len(numbers) and not -(2**31) <= numbers.min() <= numbers.max() < 2**31:
                    raise MeshFileError("names a vertex by a number that is too large; export it again")
                size += len(numbers)
            if kind != "polygons" and len(lists) > 1:
                raise MeshFileError(f"has several lists (p) in one element {kind}; export it again")
            if kind == "triangles":
                held = size / (3 * width)
            else:
                held = len(lists) if kind == "polygons" else len(_numbers(primitive.find("{*}vcount"), np.int64))
            _check_count(primitive, kind, held)


def _numbers(element: Any, of: type) -> NDArray[Any]:
    text = "" if element is None else element.text
    return np.empty(0, of) if not text or text.isspace() else np.fromstring(text, of, sep=" ")


def _check_count(element: Any, what: str, held: float) -> None:
    if (count := element.get("count")) is not None and int(count) != held:
        raise MeshFileError(f"declares {int(count)} {what} but contains {held:g}; copy or export it again")


def _unit(document: Any) -> float:
    """Metres of the file's unit."""
    unit = document.assetInfo.unitmeter
    if unit is None:
        return 1.0
    if not (math.isfinite(unit) and unit > 0):
        raise MeshFileError(f"its unit is {unit} metres; it must be finite and positive")
    return float(unit)


def _instances(collada: Any, nodes: list[Any]) -> Iterator[tuple[Any, NDArray[Any]]]:
    """(geometry, its transform) for each instance, in the order of the scene."""
    waiting = [(node, np.eye(4)) for node in reversed(nodes)]
    visited = 0
    while waiting:
        node, matrix = waiting.pop()
        visited += 1
        if visited > MOST_NODES:
            raise MeshFileError(f"its scene has more than {MOST_NODES} nodes; export it flat")
        if isinstance(node, collada.scene.GeometryNode):
            yield node.geometry, matrix
        elif isinstance(node, collada.scene.Node):
            inner = matrix @ np.asarray(node.matrix, np.float64)
            waiting += [(child, inner) for child in reversed(node.children)]


def _triangles(collada: Any, primitive: Any) -> NDArray[np.int64]:
    """(F,3) indices into the primitive's positions."""
    corners = np.asarray(primitive.vertex_index, np.int64).reshape(-1)
    positions = np.asarray(primitive.vertex, np.float64)
    if len(corners) and not (0 <= corners.min() and corners.max() < len(positions)):
        raise MeshFileError(f"a face names a vertex beyond the {len(positions)} of its geometry; export it again")
    if not np.isfinite(positions).all():
        raise MeshFileError(_NOT_FINITE)
    if isinstance(primitive, collada.triangleset.TriangleSet):
        return corners.reshape(-1, 3)
    counts = np.asarray(primitive.vcounts, np.int64)
    if (counts < 0).any() or counts.sum() != len(corners):
        raise MeshFileError(
            f"its polygons have {counts.sum()} corners but {len(corners)} are listed; copy or export it again"
        )
    large = counts >= 3
    return Polygons(positions, corners[np.repeat(large, counts)], counts[large]).triangles()
