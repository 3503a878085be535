# SPDX-License-Identifier: Apache-2.0
"""A robot in a scene: its description, its joint positions over time, and the exact poses of its links.

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
    geometry      of which its meshes are: "collision" or "visual"

    Topics: `description` (std_msgs/String, latched), and its joints (sensor_msgs/JointState).
    """

    name: str
    description: str
    motion: Callable[[float], Mapping[str, float]]
    description_topic: str = "robot_description"
    joint_states_topic: str = "joint_states"
    geometry: str = "collision"

    @cached_property
    def robot(self) -> Robot:
        return Robot.of(self.description, geometry=self.geometry, name=self.name)

    @cached_property
    def meshes(self) -> tuple[Mesh, ...]:
        return tuple(
            Mesh(mesh.name, mesh.topology.faces, mesh.topology.n_vertices, self_collision=False)
            for mesh in self.robot.meshes
        )

    def joint_positions(self, time: float) -> dict[str, float]:
        """Published value of each joint that moves and mimics none: multiples of 1 / JOINT_STEPS."""
        values = self.motion(time)
        return {name: round(values[name] * JOINT_STEPS) / JOINT_STEPS for name in self.robot.kinematics.inputs}

    def vertices(self, time: float) -> list[np.ndarray]:
        """(V,3) float64 of each of `meshes`."""
        corners, link, ends = self._corners
        turns, shifts = self._poses(self.robot.kinematics.state(self.joint_positions(time)).values)
        return np.split(rotate(turns[link], corners) + shifts[link], ends)

    @cached_property
    def _corners(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Vertices of all meshes in their links' frames, the number of the link of each, and where a mesh ends."""
        meshes = self.robot.meshes
        counts = [len(mesh.vertices) for mesh in meshes]
        corners = np.concatenate([mesh.vertices for mesh in meshes])
        links = np.repeat([self.robot.kinematics.number(mesh.link) for mesh in meshes], counts)
        return np.rint(corners * CORNER_STEPS) / CORNER_STEPS, links, np.cumsum(counts)[:-1]

    @cached_property
    def _chain(self) -> tuple[np.ndarray, ...]:
        """For the joint of each link: axis where it turns, else 0; axis where it slides, else 0; origin's quaternion
        (w first) and shift."""
        chain = self.robot.kinematics.chain.joints
        axes = np.array([joint.axis for joint in chain])
        turning = np.array([joint.turns for joint in chain])[:, None]
        sliding = np.array([joint.kind == "prismatic" for joint in chain])[:, None]
        origins = np.array([np.roll(joint.origin.quaternion, 1) for joint in chain])
        return axes * turning, axes * sliding, origins, np.array([joint.origin.shift for joint in chain])

    def _poses(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Quaternions (w first) and shifts of all links, the root's first."""
        turning, sliding, origins, shifts = self._chain
        # Where no axis is, an angle would shorten the quaternion.
        angles = np.where(turning.any(axis=1), values, 0.0)
        turns = product(origins, axis_angle(turning, angles))
        shifts = shifts + rotate(origins, sliding * values[:, None])
        for number, joint in enumerate(self.robot.kinematics.chain.joints):
            if joint.parent >= 0:
                shifts[number] = shifts[joint.parent] + rotate(turns[joint.parent], shifts[number])
                turns[number] = product(turns[joint.parent], turns[number])
        return turns, shifts
