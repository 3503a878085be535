# SPDX-License-Identifier: Apache-2.0
"""All topics that the node listens to while it is active."""

from typing import Any

from rclpy.node import Node

from hpccd_ros.frames.pipeline import FramePipeline
from hpccd_ros.node.accounts import Accounts
from hpccd_ros.node.mesh_subscriptions import MeshSubscriptions
from hpccd_ros.node.mesh_topic import Reception
from hpccd_ros.node.transform_subscriptions import TransformSubscriptions


class Subscriptions:
    """Nothing is subscribed before ``open``; ``close`` ends what is, should ``open`` have failed half-way too.

    meshes: mesh name -> parameters mesh.NAME.*.
    """

    def __init__(self, node: Node, settings: dict[str, Any], meshes: dict[str, dict[str, Any]]) -> None:
        self._node = node
        self._settings = settings
        self._meshes = meshes
        self._of_meshes: list[MeshSubscriptions] = []
        self._of_transforms: list[TransformSubscriptions] = []

    def open(self, pipeline: FramePipeline, accounts: Accounts) -> None:
        if any("tf" in (mesh["transform"], mesh["input"]) for mesh in self._meshes.values()):
            transforms = TransformSubscriptions(self._node, pipeline, accounts, self._settings["max_rate"])
            self._of_transforms.append(transforms)
        for name, mesh in self._meshes.items():
            reception = Reception(self._node, name, self._settings, pipeline, accounts)
            self._of_meshes.append(MeshSubscriptions(reception, mesh["input"]))

    def close(self) -> None:
        for subscriptions in (*self._of_meshes, *self._of_transforms):
            subscriptions.close()
        self._of_meshes.clear()
        self._of_transforms.clear()

    def warnings(self) -> list[str]:
        """What is odd about the publishers."""
        return [line for mesh in self._of_meshes for line in mesh.warnings()]
