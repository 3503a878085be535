# SPDX-License-Identifier: Apache-2.0
"""The mesh of a file as a topology, and as positions placed by a pose if the mesh is static."""

from typing import Any

import numpy as np

from hpccd_core import MeshFileError
from hpccd_ros.base.quoting import shortened
from hpccd_ros.frames.coordinates import unusable_coordinates
from hpccd_ros.frames.types import POSE, TF, MeshFrame, Topology
from hpccd_ros.rigid.transform import Rigid


def mesh_of_file(vertices: np.ndarray, faces: np.ndarray, values: dict[str, Any]) -> tuple[Topology, MeshFrame | None]:
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
