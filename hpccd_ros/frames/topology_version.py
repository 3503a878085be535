# SPDX-License-Identifier: Apache-2.0
"""Which topology follows another, and which frame belongs to it: rules 1 and 2 of the assembler. No ROS."""

from collections import deque

from hpccd_ros.base.quoting import counted
from hpccd_ros.frames.drops import Aspect, Input, Reason, Rejection
from hpccd_ros.frames.types import UNKNOWN_TIME, MeshFrame, Topology

# The depth of the node's subscription to topologies (middleware/qos.py): this many can have overtaken a frame.
_IN_THE_SUBSCRIPTION = 10


class TopologyHistory:
    """The current topology of a mesh, and earlier ones whose frames may still arrive.

    Topologies and vertices are separate topics: a node that was busy for the length of a frame may read the next
    topology before the last vertices of the previous one. waiting: frames that may wait for a transform meanwhile.
    """

    def __init__(self, waiting: int) -> None:
        self.current: Topology | None = None
        self.sent = UNKNOWN_TIME  # when the last message with the current topology was sent
        self.rejected = ""  # why a later topology was
        self._superseded: deque[Topology] = deque(maxlen=_IN_THE_SUBSCRIPTION + waiting)

    def put(self, topology: Topology) -> None:
        """Make a topology the current one; a version lower than the previous one is a restart."""
        if self.current is not None and self.current.version < topology.version:
            self._superseded.append(self.current)
        else:
            self._superseded.clear()
        self.current = topology
        self.sent, self.rejected = topology.sent, ""

    def sent_of(self, topology: Topology) -> int:
        """When it was last sent."""
        return self.sent if topology is self.current else topology.sent

    def of(self, frame: MeshFrame) -> Topology | None:
        """The one that the frame names, if it was the current one after the last accepted frame; otherwise the current
        one."""
        named = (t for t in self._superseded if t.version == frame.version)
        return next(named, self.current)

    def same_as(self, carried: Topology) -> Topology:
        """The current one if it equals the topology of a frame, otherwise the latter."""
        if self.current is not None and carried.version == self.current.version and carried.same_content(self.current):
            self.sent = carried.sent
            return self.current
        return carried

    def accept(self, frame: MeshFrame) -> bool:
        """Call it for accepted frames: later ones belong to the same topology or a later one. Returns whether the frame
        contained a new one, which is now the current one."""
        if frame.topology is not self.current and not any(frame.topology is t for t in self._superseded):
            self.put(frame.topology)
            return True
        if frame.topology is self.current:
            self._superseded.clear()
        while self._superseded and self._superseded[0] is not frame.topology:
            self._superseded.popleft()
        return False


def check_successor(mesh: str, topology: Topology, current: Topology) -> Rejection | None:
    """None if ``topology``, with other content, can follow ``current`` from the same publisher."""
    if topology.version == current.version:
        text = f"version {topology.version} is in force with other content; count the version up with each change"
        return rejected_topology(mesh, Reason.TOPOLOGY_CONFLICT, text, topology)
    if topology.version < current.version:
        text = f"version {topology.version} is older than {current.version}, now in force"
        return rejected_topology(mesh, Reason.OLD_TOPOLOGY, text, topology)
    return None


def rejected_topology(mesh: str, reason: Reason, text: str, topology: Topology) -> Rejection:
    return Rejection(mesh, reason, text, what=Input.TOPOLOGY, aspect=Aspect.TOPOLOGY, sent=topology.sent)


def is_early(frame: MeshFrame, topology: Topology | None) -> bool:
    """The frame belongs to a topology that has not arrived."""
    return topology is None or (frame.version is not None and frame.version > topology.version)


def check_frame(mesh: str, frame: MeshFrame, topology: Topology) -> Rejection | None:
    """None if a frame that is not early belongs to ``topology``, of its history."""
    if frame.version is not None and frame.version < topology.version:
        text = f"vertices belong to topology version {frame.version}, version {topology.version} is in force"
        return Rejection(mesh, Reason.OLD_TOPOLOGY, text, sent=frame.sent)
    if len(frame.vertices) != topology.n_vertices:
        given = counted(len(frame.vertices), "vertex", "vertices")
        text = f"{given}, topology version {topology.version} has {topology.n_vertices}"
        return Rejection(mesh, Reason.WRONG_COUNT, text, sent=frame.sent)
    return None
