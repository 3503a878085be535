# SPDX-License-Identifier: Apache-2.0
"""Where one mesh is: each message is counted, checked, turned into arrays and pushed into the pipeline."""

import time
from typing import Any

from hpccd_ros.frames.drops import Reason
from hpccd_ros.frames.welding import Welding
from hpccd_ros.middleware import mesh_inputs, qos, unreadable
from hpccd_ros.middleware.fields import InvalidMessageError
from hpccd_ros.node.hand_over import hand_over
from hpccd_ros.node.mesh_topic import UNREADABLE, MeshTopic, Reception


class PositionsSubscription(MeshTopic):
    """kind: one of topic_names.POSITIONS."""

    def __init__(self, reception: Reception, kind: str) -> None:
        super().__init__(reception, kind)
        self._welding = Welding()
        self._unreadable = 0  # messages counted as such since the last that was read
        settings = reception.settings
        profile = qos.vertices(settings["input_reliability"], settings["input_depth"])
        unreadable.watch(self.subscribe(self.receive, profile), self._on_unreadable)

    def receive(self, message: Any, info: dict[str, Any]) -> None:
        received, of = time.monotonic(), self.reception
        self.take(info)
        self._count_received(info)
        if why := self.too_fast():
            self.refuse(Reason.RATE, why)
            return
        # Asked only where it can matter, as it takes 4 us: of a frame in another frame_id, which may be a restart.
        here = hasattr(message, "header") and message.header.frame_id == of.pipeline.coordinate_frame[0]
        alone = here or self.publishers <= 1
        sent = info["source_timestamp"]
        try:
            frame = mesh_inputs.read(self.kind, message, of.settings, received, alone, sent=sent, welding=self._welding)
        except InvalidMessageError as error:
            self.taken(sent, False)  # listed, because a replay reads and refuses it too
            of.accounts.refused(error.refusal(of.mesh, aspect=self.aspect, sent=sent))
            return
        new_publisher = self.numbers.notice()
        self.taken(sent, new_publisher, not alone)
        hand_over(of.pipeline.push(of.mesh, frame, new_publisher), of.pipeline, of.accounts)

    def _count_received(self, info: dict[str, Any]) -> None:
        of = self.reception
        transport = (info["received_timestamp"] - info["source_timestamp"]) * 1e-6
        of.accounts.metrics.frame_received(of.mesh, transport if transport >= 0 else None)
        missing, _ = self.numbers.next(info["publication_sequence_number"])
        unreadable, self._unreadable = self._unreadable, 0
        of.accounts.connections[f"before_first.{of.mesh}"] = self.numbers.before_first
        # Numbers of several publishers interleave: their gaps mean nothing.
        if missing <= unreadable or self.publishers > 1:
            return
        missing -= unreadable
        if unreadable:  # some of the same gap were, so that these are taken for unreadable too
            of.accounts.metrics.frame_received(of.mesh, None, missing)
            self.refuse(Reason.MALFORMED, f"{self.name}: {UNREADABLE}", missing)
            return
        text = (
            f"{missing} messages did not reach the node: they came faster than it reads (parameter input_depth) or "
            "could not be deserialised (see the log of DDS)"
        )
        self.refuse(Reason.MIDDLEWARE, text, missing)

    def _on_unreadable(self) -> None:
        self._unreadable += 1
        self.reception.accounts.metrics.frame_received(self.reception.mesh, None, 1)
        self.refuse_unreadable()
