# SPDX-License-Identifier: Apache-2.0
"""The names of all topics and services of the node; relative ones follow its namespace and remappings."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING

from hpccd_ros.base.quoting import shortened

if TYPE_CHECKING:  # writers of files need the names, but no ROS
    from rclpy.node import Node

CONTACTS = "contacts"
DISTANCES = "distances"
PAIRS = "pairs"
STOP = "stop"
SPEED_SCALE = "speed_scale"
MARKERS = "markers"
SURFACE = "surface"
DIAGNOSTICS = "/diagnostics"
PUBLISHED = (CONTACTS, DISTANCES, PAIRS, STOP, SPEED_SCALE, MARKERS, SURFACE, DIAGNOSTICS)

TRANSFORMS = "transforms"
TRANSFORMS_STATIC = "transforms_static"
TF = "/tf"
TF_STATIC = "/tf_static"

# A service, and an action with services and topics below this name.
DETECT = "~/detect"
SERVICES = (DETECT, *(f"{DETECT}/_action/{kind}" for kind in ("send_goal", "cancel_goal", "get_result")))

# Topics of a mesh: faces, and positions as MeshVertices or PointCloud2; or both at once, as shape_msgs/Mesh or
# visualization_msgs/Marker; or, for a rigid mesh, poses as PoseStamped.
TOPOLOGY = "topology"
VERTICES = "vertices"
POINTS = "points"
SHAPE = "shape"
MARKER = "marker"
WHOLE = (SHAPE, MARKER)
POSE = "pose"
POSITIONS = (VERTICES, POINTS, *WHOLE, POSE)
# A rigid mesh that transforms move: only its shape is published.
BY_TRANSFORMS = "tf"
INPUTS = (*POSITIONS, BY_TRANSFORMS)


def positions(given_as: str) -> tuple[str, ...]:
    """Topics of POSITIONS that a mesh with this parameter ``input``, one of INPUTS, uses; a rigid mesh has its shape
    from vertices."""
    return {POSE: (POSE, VERTICES), BY_TRANSFORMS: (VERTICES,)}.get(given_as, (given_as,))


def is_whole(given_as: str, points: bool) -> bool:
    """Whether each message with positions of a mesh contains its topology: a cloud has all of a mesh of points
    (parameter ``points``)."""
    return given_as in WHOLE or (points and given_as == POINTS)


# A mesh name becomes part of topic and parameter names.
MESH_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")

# Prefix of the names of topics of meshes.
MESHES = "meshes/"


def of_mesh(mesh: str, kind: str) -> str:
    """kind: TOPOLOGY or one of POSITIONS."""
    return f"{MESHES}{mesh}/{kind}"


def topology(mesh: str) -> str:
    return of_mesh(mesh, TOPOLOGY)


def vertices(mesh: str) -> str:
    return of_mesh(mesh, VERTICES)


def points(mesh: str) -> str:
    return of_mesh(mesh, POINTS)


def subscribed(meshes: Iterable[str], of_robots: Iterable[str] = ()) -> list[str]:
    """All topics that the node may subscribe to. of_robots: topics of descriptions and joint states."""
    of_meshes = [of_mesh(mesh, kind) for mesh in meshes for kind in (TOPOLOGY, *POSITIONS)]
    return [*of_meshes, TRANSFORMS, TRANSFORMS_STATIC, TF, TF_STATIC, *of_robots]


def unusable_name(node: Node, subscribed: Iterable[str]) -> str | None:
    """Why a topic or service of the node cannot exist under its name here (namespace, remapping), or None."""
    for resolve, names in ((node.resolve_topic_name, (*PUBLISHED, *subscribed)), (node.resolve_service_name, SERVICES)):
        for name in names:
            try:
                resolve(name)
            # rclpy's. Names of meshes are valid, but may be too long. Topics of robots may have any name.
            except RuntimeError as error:
                return (
                    f"{shortened(name)}: in namespace {shortened(node.get_namespace())} and with the remappings given, "
                    f"this name cannot be used ({_reason(error)}); give a shorter mesh name, namespace or remapping"
                )
    return None


def _reason(error: RuntimeError) -> str:
    # "failed to resolve name: REASON, at SOURCE": the limit is 247 characters.
    return str(error).removeprefix("failed to resolve name: ").partition(", at ")[0].replace("255U - 8U", "247")
