# SPDX-License-Identifier: Apache-2.0
"""Read a mesh file: vertices and triangles as they are numbered in the file, optionally placed by a pose."""

from pathlib import Path
from typing import Any

import numpy as np

from hpccd_ros.base.quoting import shortened
from hpccd_ros.frames import collada_file
from hpccd_ros.frames.coordinates import unusable_coordinates
from hpccd_ros.frames.types import POSE, TF, MeshFrame, Topology
from hpccd_ros.frames.welding import weld
from hpccd_ros.rigid.transform import Rigid

FORMATS = (".obj", ".ply", ".stl", ".dae")


class MeshFileError(ValueError):
    """A mesh file that cannot be used; the text names it and the remedy."""


def load_mesh(path: str) -> tuple[np.ndarray, np.ndarray]:
    """(vertices (n,3) float64, faces (F,3) uint32) of an OBJ, PLY, STL or DAE file, in the file's own numbering.

    STL repeats the corners of each triangle; equal ones (bit for bit) become one vertex, in order of first
    use. Polygons become triangle fans. DAE: see collada_file.parse. Raises MeshFileError: trimesh or pycollada missing,
    no such file, other format, no triangles.
    """
    file = existing(path)
    vertices, faces = _of_collada(file) if file.suffix.lower() == ".dae" else _by_trimesh(file)
    if len(faces) == 0:
        raise MeshFileError(f"{file}: has no triangles")
    if file.suffix.lower() == ".stl":
        first, vertex_of = weld(vertices)
        vertices, faces = vertices[first], vertex_of[faces]
    if problem := unusable_coordinates(vertices):
        raise MeshFileError(f"{file}: {problem[1]}")
    return vertices, faces.astype(np.uint32)


def _of_collada(file: Path) -> tuple[np.ndarray, np.ndarray]:
    try:
        return collada_file.parse(file.read_bytes())
    except Exception as error:  # pycollada raises whatever its parsers meet
        why = shortened(" ".join(str(error).split())) or type(error).__name__
        raise MeshFileError(f"{file}: cannot be read: {why}") from error


def _by_trimesh(file: Path) -> tuple[np.ndarray, np.ndarray]:
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
        why = _not_text(file) or shortened(" ".join(str(error).split()))
        raise MeshFileError(f"{file}: cannot be read: {why}") from error
    return np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces)


def existing(path: str) -> Path:
    """The file, which is one of FORMATS by its name. Raises MeshFileError: it is not, or there is no such file."""
    shown = shortened(path)
    if (suffix := Path(path).suffix).lower() not in FORMATS:
        raise MeshFileError(f"{shown}: format {shortened(suffix) or '(none)'!r}; use one of {', '.join(FORMATS)}")
    try:
        file = Path(path).expanduser()
        if file.is_file():
            return file
    except RuntimeError as error:  # ~name, and there is no such user
        raise MeshFileError(f"{shown}: no such home folder; give the whole path") from error
    except OSError as error:
        raise MeshFileError(f"{shown}: {error.strerror}; give the path of a file that can be read") from error
    raise MeshFileError(f"{shown}: no such file (relative paths start from {Path.cwd()})")


def _not_text(file: Path) -> str | None:
    """What is wrong where bytes are no text but have to be: trimesh then speaks of a module to guess what they are."""
    try:
        file.read_bytes().decode("utf-8")
    except UnicodeDecodeError:
        if file.suffix.lower() == ".stl":
            return "neither a binary STL (its length does not fit its number of triangles) nor text; export it anew"
        if file.suffix.lower() == ".obj":
            return "its text is not UTF-8; save it as UTF-8"
    except OSError:
        pass  # then that is what trimesh says
    return None


def mesh_of_file(
    vertices: np.ndarray, faces: np.ndarray, values: dict[str, Any]
) -> tuple[Topology, MeshFrame | None]:
    """What `load_mesh` gave as topology version 0; of a static mesh the positions too, placed by its pose; of one that
    moves by poses the vertices as they are. values: parameters mesh.NAME.*.

    Raises MeshFileError: as `place`.
    """
    frame = None
    if values["static"]:
        frame = MeshFrame(0, place(vertices, values["pose"]), version=0)
    elif values["input"] in (POSE, TF):
        place(vertices, values["pose"], by_poses=True)  # to be refused with the file's name rather than with each pose
        frame = MeshFrame(0, vertices, version=0)
    return Topology(0, len(vertices), faces), frame


def place(vertices: np.ndarray, pose: list[float], by_poses: bool = False) -> np.ndarray:
    """Rotate by the quaternion x y z w, then translate by x y z (pose: 3 + 4 numbers). by_poses: of a mesh that
    moves by poses.

    Raises MeshFileError: not 7 numbers, not finite, quaternion not of unit length within 1e-3, too far away.
    """
    try:
        placed = Rigid.of(pose[:3], pose[3:]).apply(vertices)
    except ValueError as error:
        raise MeshFileError(f"pose: {shortened(pose)} {error}") from error
    if problem := unusable_coordinates(placed, by_poses):
        raise MeshFileError(f"pose: {shortened(pose)}: placed by it, {problem[1]}")
    return placed
