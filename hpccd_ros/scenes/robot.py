# SPDX-License-Identifier: Apache-2.0
"""A robot in a scene: what it is, its joints over time, and where its links are, to the bit.

Sines of the C library differ in their last bits from machine to machine, and with them the arm's joint values and the
corners of its round links. So both are rounded here, to steps far larger than these differences: only a value within
1e-14 of the middle between two steps could come out otherwise elsewhere, and for the frames that a scene has by default
a test sees that none is. From there on, links are placed by exactmath.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hpccd_ros.robots.robot import Robot
from hpccd_ros.scenes.exactmath import axis_angle, product, rotate
from hpccd_ros.scenes.scene import Mesh

JOINT_STEPS = 2.0**20  # in a radian, or a metre
CORNER_STEPS = 2.0**30  # in a metre


@dataclass(frozen=True, eq=False)
class SceneRobot:
    """Its root link stands at the scene's origin.

    name          before the links' in names of meshes: NAME/LINK
    description   URDF, its collision geometry of boxes, cylinders and spheres, no frame turned by rpy
    motion        seconds since frame 0 -> values of its joints, radians or metres

    Topics: `description` (std_msgs/String, latched), and its joints (sensor_msgs/JointState).
    """

    name: str
    description: str
    motion: Callable[[float], Mapping[str, float]]
    description_topic: str = "robot_description"
    joint_states_topic: str = "joint_states"

    @cached_property
    def robot(self) -> Robot:
        return Robot.of(self.description, name=self.name)

    @cached_property
    def meshes(self) -> tuple[Mesh, ...]:
        return tuple(
            Mesh(mesh.name, mesh.topology.faces, mesh.topology.n_vertices, self_collision=False)
            for mesh in self.robot.meshes
        )

    def joint_positions(self, time: float) -> dict[str, float]:
        """Of each joint that moves and mimics none: multiples of 1 / JOINT_STEPS, which is what is published."""
        values = self.motion(time)
        return {name: round(values[name] * JOINT_STEPS) / JOINT_STEPS for name in self.robot.kinematics.inputs}

    def vertices(self, time: float) -> list[np.ndarray]:
        """(V,3) float64 of each of `meshes`."""
        poses = self._poses(self.robot.kinematics.state(self.joint_positions(time)).values)
        placed = []
        for mesh, corners in zip(self.robot.meshes, self._corners, strict=True):
            turn, shift = poses[self.robot.kinematics.number(mesh.link)]
            placed.append(rotate(turn, corners) + shift)
        return placed

    @cached_property
    def _corners(self) -> list[np.ndarray]:
        return [np.rint(mesh.vertices * CORNER_STEPS) / CORNER_STEPS for mesh in self.robot.meshes]

    def _poses(self, values: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """(quaternion w x y z, shift) of each link, the root's first."""
        found: list[tuple[np.ndarray, np.ndarray]] = []
        for joint, value in zip(self.robot.kinematics.chain, values, strict=True):
            turn, shift = found[joint.parent] if joint.parent >= 0 else (np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3))
            shift = shift + rotate(turn, joint.origin.shift)
            turn = product(turn, np.roll(joint.origin.quaternion, 1))
            if joint.turns:
                turn = product(turn, axis_angle(joint.axis, value))
            elif joint.kind == "prismatic":
                shift = shift + rotate(turn, joint.axis * value)
            found.append((turn, shift))
        return found
