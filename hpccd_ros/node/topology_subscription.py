# SPDX-License-Identifier: Apache-2.0
"""The topology of one mesh: each message is checked and pushed into the pipeline."""

from typing import Any

from hpccd.msg import MeshTopology

from hpccd_ros.detect.core import unusable_topology
from hpccd_ros.frames.drops import Reason
from hpccd_ros.middleware import mesh_inputs, qos, topic_names, unreadable
from hpccd_ros.middleware.fields import InvalidMessageError
from hpccd_ros.node.hand_over import hand_over
from hpccd_ros.node.mesh_topic import MeshTopic, Reception


class TopologySubscription(MeshTopic):
    def __init__(self, reception: Reception) -> None:
        super().__init__(reception, topic_names.TOPOLOGY)
        unreadable.watch(self.subscribe(self.receive, qos.TOPOLOGY_INPUT), self.refuse_unreadable)

    def receive(self, message: MeshTopology, info: dict[str, Any]) -> None:
        of = self.reception
        self.take(info)
        _, new_publisher = self.numbers.next(info["publication_sequence_number"])
        if why := self.too_fast():
            self.refuse(Reason.RATE, why)
            return
        try:
            topology = mesh_inputs.read(self.kind, message, of.settings, sent=info["source_timestamp"])
        except InvalidMessageError as error:
            of.accounts.refused(error.refusal(of.mesh, self.what, self.aspect, self.sent))
            return
        if why := unusable_topology(topology):
            self.refuse(Reason.BAD_TOPOLOGY, why)
            return
        self.taken(info["source_timestamp"], new_publisher)
        hand_over(of.pipeline.push(of.mesh, topology, new_publisher), of.pipeline, of.accounts)
