# SPDX-License-Identifier: Apache-2.0
"""All topics that the node listens to while it is active."""

from collections.abc import Mapping
from typing import Any

from rclpy.node import Node

from hpccd_ros.frames.pipeline import FramePipeline
from hpccd_ros.node import topic_types
from hpccd_ros.node.accounts import Accounts
from hpccd_ros.node.joint_subscriptions import JointSubscriptions
from hpccd_ros.node.mesh_subscriptions import MeshSubscriptions
from hpccd_ros.node.mesh_topic import Reception
from hpccd_ros.node.transform_subscriptions import TransformSubscriptions
from hpccd_ros.params import robot_parameters
from hpccd_ros.params.table import ROBOT
from hpccd_ros.robots.joint_frames import JointFrames


class Subscriptions:
    """Nothing is subscribed before ``open``; ``close`` ends what is, should ``open`` have failed half-way too.

    meshes: mesh name -> parameters mesh.NAME.*.
    """

    def __init__(self, node: Node, settings: dict[str, Any], meshes: dict[str, dict[str, Any]]) -> None:
        self._node = node
        self._settings = settings
        self._meshes = meshes
        self._of_meshes: list[MeshSubscriptions] = []
        self._of_others: list[TransformSubscriptions | JointSubscriptions] = []

    def open(self, pipeline: FramePipeline, by_joints: Mapping[str, JointFrames], accounts: Accounts) -> None:
        """by_joints: robot -> what its joint states move, of those that are known."""
        if topic_types.uses_transforms(self._settings, self._meshes):
            transforms = TransformSubscriptions(self._node, pipeline, accounts, self._settings["max_rate"])
            self._of_others.append(transforms)
        if robot_parameters.joint_topics(self._settings[ROBOT]):
            joints = JointSubscriptions(self._node, self._settings, pipeline, by_joints, accounts)
            self._of_others.append(joints)
        for name, mesh in self._meshes.items():
            reception = Reception(self._node, name, self._settings, pipeline, accounts)
            self._of_meshes.append(MeshSubscriptions(reception, mesh["input"]))

    def use(self, pipeline: FramePipeline, by_joints: Mapping[str, JointFrames]) -> None:
        """What comes goes there from now on."""
        for part in (*self._of_meshes, *self._of_others):
            part.use(pipeline, by_joints)

    def close(self) -> None:
        for subscriptions in (*self._of_meshes, *self._of_others):
            subscriptions.close()
        self._of_meshes.clear()
        self._of_others.clear()

    def warnings(self) -> list[str]:
        """What is odd about the publishers."""
        return [line for part in (*self._of_meshes, *self._of_others) for line in part.warnings()]
