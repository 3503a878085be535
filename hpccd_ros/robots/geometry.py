# SPDX-License-Identifier: Apache-2.0
"""The geometry of a link as one mesh in the link's frame."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from hpccd_core import MeshFileError, load_mesh
from hpccd_ros.base.quoting import quoted, shortened
from hpccd_ros.frames.coordinates import unusable_coordinates
from hpccd_ros.robots import solids
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.shapes import MeshFile, Placed
from hpccd_ros.robots.urdf import DOCUMENT, Link

#: Limit for one robot: a few words of a description may request millions, or one file a thousand times.
MOST_TRIANGLES = 10_000_000

#: From the URI of a mesh to its path on this machine.
Resolver = Callable[[str], str]


def no_files(uri: str) -> str:
    """A `Resolver` for descriptions that must not name files."""
    raise RobotError(f"mesh {quoted(uri)}: no files are read here; give a resolver")


def beside(folder: Path, otherwise: Resolver) -> Resolver:
    """A `Resolver`: relative paths start at ``folder``, that of the description's file."""

    def resolve(uri: str) -> str:
        return otherwise(uri) if "://" in uri or Path(uri).is_absolute() else str(folder / uri)

    return resolve


class LinkMeshes:
    """tolerance: how far the meshes of round shapes may stand out of them (solids.py)."""

    def __init__(self, resolver: Resolver, tolerance: float) -> None:
        self._resolver = resolver
        self._tolerance = tolerance
        self._files: dict[str, solids.Triangles] = {}
        self._triangles = 0

    def of(self, link: Link) -> solids.Triangles | None:
        """(vertices (n,3) float64, faces (F,3) uint32) of all its shapes, concatenated; None: it has none.

        Raises RobotError naming the link.
        """
        vertices, faces, count = [], [], 0
        for part in link.geometry:
            try:
                corners, triangles = self._of_shape(part)
            except (RobotError, MeshFileError) as error:
                raise RobotError(f"{DOCUMENT}, line {part.line}: link {quoted(link.name)}: {error}") from error
            self._triangles += len(triangles)
            if self._triangles > MOST_TRIANGLES:
                raise RobotError(
                    f"{DOCUMENT}, line {part.line}: link {quoted(link.name)}: more than {MOST_TRIANGLES} triangles up "
                    "to here; use simpler shapes or a larger tolerance"
                )
            placed = part.origin.apply(corners)
            if problem := unusable_coordinates(placed):
                raise RobotError(f"{DOCUMENT}, line {part.line}: link {quoted(link.name)}: {problem[1]}")
            vertices.append(placed)
            faces.append(triangles + np.uint32(count))
            count += len(corners)
        return (np.concatenate(vertices), np.concatenate(faces)) if faces else None

    def _of_shape(self, part: Placed) -> solids.Triangles:
        if not isinstance(part.shape, MeshFile):
            return solids.triangles(part.shape, self._tolerance)
        uri = part.shape.uri
        if uri not in self._files:
            path = self._resolver(uri)
            if not Path(path).is_absolute():
                raise RobotError(
                    f"mesh {shortened(uri)}: a relative path needs the folder of a description's file; write "
                    "package://PACKAGE/PATH or file:///PATH"
                )
            self._files[uri] = load_mesh(path)
        corners, triangles = self._files[uri]
        return corners * np.array(part.shape.scale), triangles
