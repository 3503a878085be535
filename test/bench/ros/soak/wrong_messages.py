# SPDX-License-Identifier: Apache-2.0
"""Wrong messages that the soak sends among the right ones, each with the reason by which the node must count it."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable

import numpy as np
from hpccd.msg import MeshTopology, MeshVertices

from hpccd_ros.frames.drops import Reason
from hpccd_ros.middleware import fields, mesh_messages

MOST_VERTICES = 20_000  # parameter max_vertices of the node that is soaked
EARLIER = 10_000_000_000  # ns


class WrongMessages:
    """Sends one wrong message at a time of one mesh.

    publish_vertices, publish_topology: take a message (or CDR bytes). sent, topologies: what the node must count,
    vertex messages and topologies by reason.
    """

    def __init__(self, publish_vertices: Callable, publish_topology: Callable, seed: int = 0):
        self._vertices, self._topology = publish_vertices, publish_topology
        self._random = random.Random(seed)
        self.sent: Counter = Counter()
        self.topologies: Counter = Counter()

    def send_one(self, xyz: np.ndarray, faces: np.ndarray, version: int, stamp: int) -> None:
        """`xyz`, `faces`, `version`: the mesh as it is; `stamp`: that of the last right message."""
        kinds = (self._malformed, self._values, self._order, self._cut, self._wrong_topology)
        self._random.choice(kinds)(xyz, faces, version, stamp)

    def _send(self, reason: Reason, message: MeshVertices | bytes) -> None:
        self.sent[reason] += 1
        self._vertices(message)

    def _malformed(self, xyz, faces, version, stamp) -> None:
        message = MeshVertices(topology_version=version)
        message.header.stamp = fields.ns_to_stamp(stamp + 1)
        if self._random.random() < 0.5:
            message.vertices_f32 = fields.to_field(xyz.ravel()[:-1])
        self._send(Reason.MALFORMED, message)

    def _values(self, xyz, faces, version, stamp) -> None:
        reason, wrong = self._random.choice(
            (
                (Reason.NOT_FINITE, np.where(np.arange(len(xyz))[:, None] == 7, np.float32(np.nan), xyz)),
                (Reason.WRONG_COUNT, xyz[:-1]),
                (Reason.TOO_LARGE, np.zeros((MOST_VERTICES + 1, 3), np.float32)),
            )
        )
        self._send(reason, mesh_messages.vertices_message(wrong, stamp + 1, topology_version=version))

    def _order(self, xyz, faces, version, stamp) -> None:
        reason, at = self._random.choice(((Reason.REPEATED, stamp), (Reason.BACKWARD, stamp - EARLIER)))
        self._send(reason, mesh_messages.vertices_message(xyz, at, topology_version=version))

    def _cut(self, xyz, faces, version, stamp) -> None:
        whole = b"\0\1\0\0" + bytes(range(1, 60))
        self._send(Reason.MALFORMED, whole[: self._random.randrange(5, len(whole))])

    def _wrong_topology(self, xyz, faces, version, stamp) -> None:
        reason, message = self._random.choice(
            (
                (Reason.INDEX_RANGE, mesh_messages.topology_message(faces, int(faces.max()), version=version + 1)),
                (Reason.TOPOLOGY_CONFLICT, mesh_messages.topology_message(faces[1:], len(xyz), version=version)),
                (Reason.MALFORMED, MeshTopology(version=version + 1, n_vertices=len(xyz), faces=[0, 1])),
            )
        )
        self.topologies[reason] += 1
        self._topology(message)
