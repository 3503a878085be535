# SPDX-License-Identifier: Apache-2.0
"""Which topology follows another, and which frame belongs to it: rules 1 and 2 of the assembler. No ROS."""

from hpccd_ros.frames.drops import Input, Reason, Refusal
from hpccd_ros.frames.types import MeshFrame, Topology


def check_successor(mesh: str, topology: Topology, current: Topology) -> Refusal | None:
    """None where ``topology``, of other content, can follow ``current`` from the same publisher."""
    if topology.version == current.version:
        text = f"version {topology.version} is in force with other content; count the version up with each change"
        return Refusal(mesh, Reason.TOPOLOGY_CONFLICT, text, what=Input.TOPOLOGY)
    if topology.version < current.version:
        text = f"version {topology.version} is older than {current.version}, now in force"
        return Refusal(mesh, Reason.OLD_TOPOLOGY, text, what=Input.TOPOLOGY)
    return None


def is_early(frame: MeshFrame, topology: Topology | None) -> bool:
    """The frame belongs to a topology that has not come."""
    return topology is None or (frame.version is not None and frame.version > topology.version)


def check_frame(mesh: str, frame: MeshFrame, topology: Topology) -> Refusal | None:
    """None where a frame that is not early belongs to the topology in force."""
    if frame.version is not None and frame.version < topology.version:
        text = f"vertices belong to topology version {frame.version}, version {topology.version} is in force"
        return Refusal(mesh, Reason.OLD_TOPOLOGY, text)
    if len(frame.vertices) != topology.n_vertices:
        text = f"{len(frame.vertices)} vertices, topology version {topology.version} has {topology.n_vertices}"
        return Refusal(mesh, Reason.WRONG_COUNT, text)
    return None
