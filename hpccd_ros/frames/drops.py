# SPDX-License-Identifier: Apache-2.0
"""Why a frame did not take part in a detection, and how often.

Whoever drops a message hands a `Refusal` back to its caller; counters at the end add them up.
The unit is one vertex message of one mesh, so that the counts add up:
received + lost in the middleware = answered + dropped + still waiting.
"""

import threading
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class Reason(StrEnum):
    """Why a message was refused (it is wrong) or dropped (it is right, but could not be used)."""

    UNKNOWN_MESH = "unknown_mesh"  # not in parameter `meshes`
    # Lengths that do not fit each other; both or neither vertex array; missing field; no time; not to be deserialised.
    MALFORMED = "malformed"
    UNSUPPORTED_TYPE = "unsupported_type"  # PointCloud2 field that is neither FLOAT32 nor FLOAT64
    BIG_ENDIAN = "big_endian"
    NOT_FINITE = "not_finite"  # NaN or infinity
    OUT_OF_RANGE = "out_of_range"  # a coordinate beyond what the core computes with
    TOO_LARGE = "too_large"  # above max_vertices, max_faces or max_edges
    INDEX_RANGE = "index_range"  # a face names a vertex that does not exist
    BAD_TOPOLOGY = "bad_topology"  # refused by the core in words of its own
    TOPOLOGY_CONFLICT = "topology_conflict"  # same version, other content
    OLD_TOPOLOGY = "old_topology"
    NO_TOPOLOGY = "no_topology"  # the topology that the frame names has not come (in time)
    NO_SHAPE = "no_shape"  # of a mesh that moves by poses: its vertices have not come
    WRONG_COUNT = "wrong_vertex_count"
    FRAME_ID = "frame_id"
    NO_TRANSFORM = "no_transform"  # mesh.NAME.transform asks for one that did not come
    NO_JOINT_STATE = "no_joint_state"  # where the joints of a robot were then is not known
    RATE = "rate"  # came faster than max_rate
    BACKWARD = "stamp_backward"
    REPEATED = "stamp_repeated"
    AHEAD = "stamp_ahead"  # of a transform or joint state: far after those that came before and after it
    CONTRADICTED = "contradicted"  # a joint state: another publisher gives the same joint another position
    LATE = "late"  # its stamp was already answered (or given up) when it came
    INCOMPLETE = "incomplete"  # another mesh had no frame for this stamp
    STATIC_MISSING = "static_missing"  # the vertices of a static mesh have not come
    RESTART = "restart"  # was waiting when the stream started anew
    OVERLOAD = "overload"  # a newer frame took its place before the detection got to it
    MIDDLEWARE = "middleware"  # never arrived: gap in the publisher's sequence numbers
    DETECTION_FAILED = "detection_failed"
    STOPPED = "stopped"  # was waiting when the node was deactivated


class Input(StrEnum):
    """What a refused message was."""

    VERTICES = "vertex messages"
    TOPOLOGY = "topologies"
    TRANSFORM = "transforms"
    JOINT_STATE = "joint states"


class Aspect(StrEnum):
    """The property of its mesh that a rejected message is about."""

    PLACE = "place"  # its position
    SHAPE = "shape"  # for meshes that move by poses
    TOPOLOGY = "topology"
    NOTHING = "nothing"  # it concerns nothing that is in use


@dataclass(frozen=True, slots=True)
class Refusal:
    """``messages`` of ``mesh`` (of a transform: its topic) that will not be used, and why.

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


class RefusalCounter:
    """Counts by mesh and reason; may be used from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._counts: dict[tuple[str, Reason], int] = {}
        self._total = 0
        self._by_mesh: dict[str, int] = {}

    def count(self, refusal: Refusal) -> None:
        """Add the messages of one refusal."""
        with self._lock:
            key = (refusal.mesh, refusal.reason)
            self._counts[key] = self._counts.get(key, 0) + refusal.messages
            self._total += refusal.messages
            self._by_mesh[refusal.mesh] = self._by_mesh.get(refusal.mesh, 0) + refusal.messages

    @property
    def total(self) -> int:
        """All drops since the start."""
        return self._total

    def most_of(self, meshes: Iterable[str]) -> int:
        """The largest count of one of these meshes: frames of the scene that were lost, as each of them has one
        message of every deforming mesh, and where one is refused its partners are counted as incomplete."""
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
