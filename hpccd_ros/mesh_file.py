# SPDX-License-Identifier: Apache-2.0
"""Read a mesh file: vertices and triangles as they are numbered in the file, optionally placed by a pose."""

from pathlib import Path

import numpy as np

from hpccd_ros import coordinates
from hpccd_ros.rigid import Rigid

FORMATS = (".obj", ".ply", ".stl")


class MeshFileError(ValueError):
    """A mesh file that cannot be used; the text names it and the remedy."""


def load_mesh(path: str) -> tuple[np.ndarray, np.ndarray]:
    """(vertices (n,3) float64, faces (F,3) uint32) of an OBJ, PLY or STL file, in the file's own numbering.

    STL repeats the corners of each triangle; equal ones (bit for bit) become one vertex, in order of first
    use. Polygons become triangle fans. Raises MeshFileError: trimesh missing, no such file, other format, no
    triangles.
    """
    file = Path(path).expanduser()
    if file.suffix.lower() not in FORMATS:
        raise MeshFileError(f"{file}: format {file.suffix or '(none)'!r}; use one of {', '.join(FORMATS)}")
    if not file.is_file():
        raise MeshFileError(f"{file}: no such file (relative paths start from {Path.cwd()})")
    try:
        import trimesh
    except ImportError as error:
        raise MeshFileError(
            f"{file}: reading mesh files needs trimesh; install it with: pip install 'hpccd[meshes]' "
            "(or pip install trimesh)"
        ) from error
    try:
        # process=False: trimesh would merge and reorder vertices, and publishers number them as the file
        # does.
        options = {"maintain_order": True, "skip_materials": True} if file.suffix.lower() == ".obj" else {}
        mesh = trimesh.load(file, force="mesh", process=False, **options)
    except Exception as error:  # trimesh raises whatever its parsers meet
        raise MeshFileError(f"{file}: cannot be read: {error}") from error
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces)
    if len(faces) == 0:
        raise MeshFileError(f"{file}: has no triangles")
    if file.suffix.lower() == ".stl":
        vertices, faces = _join_equal(vertices, faces)
    if refusal := coordinates.refusal(vertices):
        raise MeshFileError(f"{file}: {refusal[1]}")
    return vertices, faces.astype(np.uint32)


def place(vertices: np.ndarray, pose: list[float]) -> np.ndarray:
    """Rotate by the quaternion x y z w, then translate by x y z (pose: 3 + 4 numbers).

    Raises MeshFileError: not 7 numbers, not finite, quaternion not of unit length within 1e-3, too far away.
    """
    try:
        placed = Rigid.of(pose[:3], pose[3:]).apply(vertices)
    except ValueError as error:
        raise MeshFileError(f"pose: {pose} {error}") from error
    if refusal := coordinates.refusal(placed):
        raise MeshFileError(f"pose: {pose}: placed by it, {refusal[1]}")
    return placed


def _join_equal(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    # + 0.0 makes -0.0 equal to 0.0 in the comparison.
    _, first, inverse = np.unique(vertices + 0.0, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return vertices[first[order]], rank[inverse.reshape(-1)][faces]
