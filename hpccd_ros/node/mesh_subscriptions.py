# SPDX-License-Identifier: Apache-2.0
"""Subscriptions to one mesh: its topology, and where it is."""

from hpccd_ros.frames.pipeline import FramePipeline
from hpccd_ros.middleware import topic_names
from hpccd_ros.node.mesh_topic import MeshTopic, Reception
from hpccd_ros.node.positions_subscription import PositionsSubscription
from hpccd_ros.node.topology_subscription import TopologySubscription


class MeshSubscriptions:
    """Subscribed from construction until ``close``. given_as: parameter mesh.NAME.input."""

    def __init__(self, reception: Reception, given_as: str) -> None:
        self._reception = reception
        self.topics: list[MeshTopic] = []
        self.topics.append(TopologySubscription(reception))
        self._positions = [PositionsSubscription(reception, kind) for kind in topic_names.positions(given_as)]
        self.topics += self._positions

    def use(self, pipeline: FramePipeline, by_joints: object) -> None:
        self._reception.pipeline = pipeline

    def close(self) -> None:
        for topic in self.topics:
            topic.close()
        self.topics.clear()

    def warnings(self) -> list[str]:
        """What is odd about the publishers of the mesh."""
        found = [(topic.publishers, topic.name) for topic in self._positions]
        several = [f"{publishers} publishers on {name}" for publishers, name in found if publishers > 1]
        unheard = [line for topic in self.topics for line in topic.warnings()]
        return unheard + several + self._reception.pipeline.awaited_transform(self._reception.mesh)
