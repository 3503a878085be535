# SPDX-License-Identifier: Apache-2.0
"""Meshes placed by poses. A rigid mesh, whose shape is given once, has a frame for each pose; a mesh file is a topology
and, for a static mesh, positions placed by its pose. No ROS."""

from typing import Any

import numpy as np

from hpccd_core import MeshFileError
from hpccd_core.rigid.body import Body
from hpccd_core.rigid.transform import Rigid
from hpccd_ros.base.quoting import quoted, shortened
from hpccd_ros.frames.coordinates import unusable_coordinates
from hpccd_ros.frames.drops import Aspect, Reason, Rejection
from hpccd_ros.frames.types import POSE, TF, UNKNOWN_TIME, MeshFrame, MeshSettings, Placement, PoseFrame, Topology


class RigidMesh:
    """``mesh``: its settings, whose ``pose`` places the vertices in the body frame."""

    def __init__(self, mesh: MeshSettings) -> None:
        self._mesh = mesh.name
        self._stands = Rigid.of(mesh.pose[:3], mesh.pose[3:])
        self._shape: MeshFrame | None = None
        self._body: Body | None = None
        self._sent = UNKNOWN_TIME  # when the shape was last sent

    def set_shape(self, shape: MeshFrame) -> Rejection | None:
        """Set its vertices, before ``pose``. Equal vertices do not interrupt the motion; a rejected shape leaves the
        previous one."""
        before = self._shape
        if before is not None and before.version == shape.version and np.array_equal(before.vertices, shape.vertices):
            self._sent = shape.sent
            return None
        vertices = self._stands.apply(shape.vertices.astype(np.float64))
        if problem := unusable_coordinates(vertices, by_poses=True):
            reason, text = problem
            text = f"placed by mesh.{self._mesh}.pose {text}"
            return Rejection(self._mesh, reason, text, aspect=Aspect.SHAPE, sent=shape.sent)
        self._shape, self._body, self._sent = shape, Body.of(vertices), shape.sent
        return None

    def place(self, frame: PoseFrame) -> MeshFrame | Rejection:
        """The vertices at a pose, as a frame of the mesh."""
        if self._shape is None or self._body is None:
            text = (
                f"a pose came, and no vertices say what it moves; give a file (parameter mesh.{self._mesh}.file), or "
                f"publish meshes/{self._mesh}/topology and once meshes/{self._mesh}/vertices, in the body's own frame"
            )
            return Rejection(self._mesh, Reason.NO_SHAPE, text, sent=frame.sent)
        placement = Placement(self._body, frame.pose)
        if problem := unusable_coordinates(placement.vertices, by_poses=True):
            reason, text = problem
            where = quoted(frame.pose.shift.tolist())
            return Rejection(self._mesh, reason, f"at the pose {where} {text}", sent=frame.sent)
        return MeshFrame(
            frame.stamp,
            placement.vertices,
            self._shape.version,
            None,
            frame.frame_id,
            frame.received,
            frame.only_publisher,
            placement=placement,
            sent=frame.sent,
            shape_sent=self._sent,
        )


def mesh_of_file(vertices: np.ndarray, faces: np.ndarray, values: dict[str, Any]) -> tuple[Topology, MeshFrame | None]:
    """The result of `load_mesh` as topology version 0, with positions: of a static mesh placed by its pose, of one that
    moves by poses as they are. values: parameters mesh.NAME.*.

    Raises MeshFileError: as `place`.
    """
    frame = None
    if values["static"]:
        frame = MeshFrame(0, place(vertices, values["pose"]), version=0)
    elif values["input"] in (POSE, TF):
        place(vertices, values["pose"], by_poses=True)  # reject it with the name of the file rather than at each pose
        frame = MeshFrame(0, vertices, version=0)
    return Topology(0, len(vertices), faces, rest=vertices), frame


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
