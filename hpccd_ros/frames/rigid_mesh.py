# SPDX-License-Identifier: Apache-2.0
"""A mesh that keeps its shape and moves by poses: the shape is given once, each pose then makes a frame. No ROS."""

import numpy as np

from hpccd_ros.base.quoting import quoted
from hpccd_ros.frames.coordinates import unusable_coordinates
from hpccd_ros.frames.drops import Aspect, Reason, Refusal
from hpccd_ros.frames.types import UNKNOWN_TIME, MeshFrame, MeshSettings, Placement, PoseFrame
from hpccd_ros.rigid.body import Body
from hpccd_ros.rigid.transform import Rigid


class RigidMesh:
    """``mesh``: its settings; their ``pose`` says where vertices stand in the body's own frame."""

    def __init__(self, mesh: MeshSettings) -> None:
        self._mesh = mesh.name
        self._stands = Rigid.of(mesh.pose[:3], mesh.pose[3:])
        self._shape: MeshFrame | None = None
        self._body: Body | None = None
        self._sent = UNKNOWN_TIME  # when the shape was last sent

    def set_shape(self, shape: MeshFrame) -> Refusal | None:
        """Its vertices, before ``pose``. The same as before leave the motion from pose to pose whole; a shape that is
        refused leaves the one before."""
        before = self._shape
        if before is not None and before.version == shape.version and np.array_equal(before.vertices, shape.vertices):
            self._sent = shape.sent
            return None
        vertices = self._stands.apply(shape.vertices.astype(np.float64))
        if problem := unusable_coordinates(vertices, by_poses=True):
            reason, text = problem
            text = f"placed by mesh.{self._mesh}.pose {text}"
            return Refusal(self._mesh, reason, text, aspect=Aspect.SHAPE, sent=shape.sent)
        self._shape, self._body, self._sent = shape, Body.of(vertices), shape.sent
        return None

    def place(self, frame: PoseFrame) -> MeshFrame | Refusal:
        """The vertices at a pose, as though they had been sent."""
        if self._shape is None or self._body is None:
            text = (
                f"a pose came, and no vertices say what it moves; give a file (parameter mesh.{self._mesh}.file), or "
                f"publish meshes/{self._mesh}/topology and once meshes/{self._mesh}/vertices, in the body's own frame"
            )
            return Refusal(self._mesh, Reason.NO_SHAPE, text, sent=frame.sent)
        placement = Placement(self._body, frame.pose)
        if problem := unusable_coordinates(placement.vertices, by_poses=True):
            reason, text = problem
            where = quoted(frame.pose.shift.tolist())
            return Refusal(self._mesh, reason, f"at the pose {where} {text}", sent=frame.sent)
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
