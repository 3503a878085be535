# SPDX-License-Identifier: Apache-2.0
"""Vertices and triangles of a COLLADA file (.dae), as RViz shows it: in metres, whatever axis the file calls up."""

import io
import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from typing import Any

import numpy as np

from hpccd_ros.base import extras

# Libraries and instances that say how it looks or moves. Broken references in them are common, and no matter here.
_LOOKS = ("library_images", "library_materials", "library_effects", "library_lights", "library_cameras",
          "library_animations", "library_animation_clips", "bind_material", "instance_light", "instance_camera",
          "extra")  # fmt: skip
# Nodes of a scene, each counted as often as it is instantiated: files whose nodes instantiate each other make millions.
MOST_NODES = 100_000


def parse(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """(vertices (n,3) float64, faces (F,3)): positions as numbered in the file, geometry after geometry in the order of
    the scene, placed by its nodes and scaled by the file's unit. Polygons become triangle fans.

    Raises UserError without pycollada, ValueError for what cannot be used, and whatever its parser meets.
    """
    collada = extras.require("collada", "meshes", "reading .dae files")
    if data[:2] == b"PK":
        raise ValueError("is a zip archive; unpack it")
    root = ElementTree.fromstring(data)
    if root.find(".//{*}instance_controller") is not None:
        raise ValueError("has geometry that a skeleton or morph moves (instance_controller); export it without")
    _drop(root, _LOOKS)
    document = collada.Collada(io.BytesIO(ElementTree.tostring(root)))
    unit = _unit(document)
    if document.scene is None:
        raise ValueError("has no scene; export it anew")
    vertices, faces, count = [], [], 0
    for geometry, matrix in _instances(collada, document.scene.nodes):
        offsets: dict[int, int] = {}  # of arrays of positions, which primitives of a geometry may share
        for primitive in geometry.primitives:
            triangles = _triangles(collada, primitive)
            if triangles is None or primitive.vertex is None:
                continue
            positions = primitive.vertex
            if len(triangles) and not (0 <= np.min(triangles) and np.max(triangles) < len(positions)):
                raise ValueError(
                    f"a triangle names a vertex beyond the {len(positions)} of its geometry; export it anew"
                )
            if id(positions) not in offsets:
                offsets[id(positions)] = count
                count += len(positions)
                placed = np.asarray(positions, np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
                vertices.append(placed * unit)
            faces.append(np.asarray(triangles, np.int64) + offsets[id(positions)])
    if not faces:
        return np.zeros((0, 3)), np.zeros((0, 3), np.int64)
    return np.concatenate(vertices), np.concatenate(faces)


def _drop(element: Any, names: tuple[str, ...]) -> None:
    for parent in element.iter():
        for child in [child for child in parent if str(child.tag).rpartition("}")[2] in names]:
            parent.remove(child)


def _unit(document: Any) -> float:
    """Metres of the file's unit."""
    unit = document.assetInfo.unitmeter
    if unit is None:
        return 1.0
    if not (math.isfinite(unit) and unit > 0):
        raise ValueError(f"its unit is {unit} metres; it must be finite and positive")
    return float(unit)


def _instances(collada: Any, nodes: list[Any]) -> Iterator[tuple[Any, np.ndarray]]:
    """(geometry, where it is placed) for each instance, in the order of the scene."""
    waiting = [(node, np.eye(4)) for node in reversed(nodes)]
    visited = 0
    while waiting:
        node, matrix = waiting.pop()
        visited += 1
        if visited > MOST_NODES:
            raise ValueError(f"its scene has more than {MOST_NODES} nodes; export it flat")
        if isinstance(node, collada.scene.GeometryNode):
            yield node.geometry, matrix
        elif isinstance(node, collada.scene.Node):
            inner = matrix @ np.asarray(node.matrix, np.float64)
            waiting += [(child, inner) for child in reversed(node.children)]


def _triangles(collada: Any, primitive: Any) -> np.ndarray | None:
    """(F,3) indices into the primitive's positions; None of lines, which have none."""
    if isinstance(primitive, collada.lineset.LineSet):
        return None
    whole = primitive if isinstance(primitive, collada.triangleset.TriangleSet) else primitive.triangleset()
    return whole.vertex_index
