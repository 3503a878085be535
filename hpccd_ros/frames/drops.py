# SPDX-License-Identifier: Apache-2.0
"""Reasons for which messages are not used, and their counters.

Code that drops a message returns a `Rejection` to its caller; counters at the end add them up. The unit is one vertex
message of one mesh, so that the counts add up:
received + lost in the middleware = processed + dropped + still waiting.
"""

import threading
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class Reason(StrEnum):
    """Why a message was rejected (it is invalid) or dropped (it is valid, but not used)."""

    UNKNOWN_MESH = "unknown_mesh"  # not in parameter `meshes`
    # Inconsistent lengths; both or neither vertex array; missing field; invalid time; cannot be deserialised.
    MALFORMED = "malformed"
    UNSUPPORTED_TYPE = "unsupported_type"  # PointCloud2 field that is neither FLOAT32 nor FLOAT64
    BIG_ENDIAN = "big_endian"
    NOT_FINITE = "not_finite"  # NaN or infinity
    OUT_OF_RANGE = "out_of_range"  # a coordinate beyond what the core computes with
    TOO_LARGE = "too_large"  # above max_vertices, max_faces or max_edges
    INDEX_RANGE = "index_range"  # a face names a vertex that does not exist
    BAD_TOPOLOGY = "bad_topology"  # rejected by the core
    TOPOLOGY_CONFLICT = "topology_conflict"  # same version, other content
    OLD_TOPOLOGY = "old_topology"
    NO_TOPOLOGY = "no_topology"  # the topology of the frame has not arrived (in time)
    NO_SHAPE = "no_shape"  # the vertices of a mesh that moves by poses have not arrived
    WRONG_COUNT = "wrong_vertex_count"
    FRAME_ID = "frame_id"
    NO_TRANSFORM = "no_transform"  # the transform of the frame did not arrive
    NO_JOINT_STATE = "no_joint_state"  # the joint positions of a robot at that stamp are unknown
    RATE = "rate"  # faster than max_rate
    BACKWARD = "stamp_backward"
    REPEATED = "stamp_repeated"
    AHEAD = "stamp_ahead"  # a transform or joint state far ahead of those before and after it
    CONTRADICTED = "contradicted"  # a joint state: another publisher gives the same joint another position
    LATE = "late"  # its stamp was already processed, or given up
    INCOMPLETE = "incomplete"  # another mesh had no frame for this stamp
    STATIC_MISSING = "static_missing"  # the positions of a static mesh have not arrived
    RESTART = "restart"  # was waiting when the stream restarted
    OVERLOAD = "overload"  # replaced by a newer frame before the detection
    MIDDLEWARE = "middleware"  # never arrived: gap in the publisher's sequence numbers
    DETECTION_FAILED = "detection_failed"
    STOPPED = "stopped"  # was waiting when the node was deactivated


class Input(StrEnum):
    """Kind of a rejected message."""

    VERTICES = "vertex messages"
    TOPOLOGY = "topologies"
    TRANSFORM = "transforms"
    JOINT_STATE = "joint states"


class Aspect(StrEnum):
    """The property of its mesh that a rejected message is about."""

    PLACE = "place"  # its position
    SHAPE = "shape"  # for meshes that move by poses
    TOPOLOGY = "topology"
    NOTHING = "nothing"  # nothing that is in use


@dataclass(frozen=True, slots=True)
class Rejection:
    """``messages`` of ``mesh`` (of a transform: its topic) that are not used, and why.

    ``text``: the problem and the remedy, for the log; "": there is no remedy. ``sent``: when the message was sent, ns
    of the system clock; None: unknown.
    """

    mesh: str
    reason: Reason
    text: str = ""
    messages: int = 1
    what: Input = Input.VERTICES
    aspect: Aspect = Aspect.PLACE
    sent: int | None = None


class RejectionCounter:
    """Counts by mesh and reason; may be used from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._counts: dict[tuple[str, Reason], int] = {}
        self._total = 0
        self._by_mesh: dict[str, int] = {}

    def count(self, rejection: Rejection) -> None:
        """Add the messages of one rejection."""
        with self._lock:
            key = (rejection.mesh, rejection.reason)
            self._counts[key] = self._counts.get(key, 0) + rejection.messages
            self._total += rejection.messages
            self._by_mesh[rejection.mesh] = self._by_mesh.get(rejection.mesh, 0) + rejection.messages

    @property
    def total(self) -> int:
        """All drops since the start."""
        return self._total

    def most_of(self, meshes: Iterable[str]) -> int:
        """The largest count of one of these meshes. It is the number of lost frames of the scene, because each of them
        has one message of every deforming mesh, and the partners of a rejected one are counted as incomplete."""
        with self._lock:
            return max((self._by_mesh.get(mesh, 0) for mesh in meshes), default=0)

    def by_reason(self) -> dict[Reason, int]:
        """Reason -> count, summed over the meshes."""
        sums: dict[Reason, int] = {}
        for (_, reason), n in self.by_mesh_and_reason().items():
            sums[reason] = sums.get(reason, 0) + n
        return sums

    def by_mesh_and_reason(self) -> dict[tuple[str, Reason], int]:
        """(mesh, reason) -> count: a copy."""
        with self._lock:
            return dict(self._counts)
