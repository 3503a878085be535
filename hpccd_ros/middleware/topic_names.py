# SPDX-License-Identifier: Apache-2.0
"""The topics of the node, known from its parameters before any is there."""

from collections.abc import Iterable

from rclpy.node import Node

from hpccd_ros.base.quoting import shortened
from hpccd_ros.middleware import transform_topics

PUBLISHED = ("contacts", "markers", "surface", "/diagnostics")
OF_MESH = ("topology", "vertices", "points")
SERVICES = ("~/detect",)


def subscribed(meshes: Iterable[str]) -> list[str]:
    """All that the node may subscribe to, by names as it writes them."""
    return [f"meshes/{mesh}/{kind}" for mesh in meshes for kind in OF_MESH] + list(transform_topics.ALL)


def refusal(node: Node, meshes: Iterable[str]) -> str | None:
    """Why a topic or service of the node cannot exist under its name here (namespace, remapping), or None."""
    for resolve, names in (
        (node.resolve_topic_name, (*PUBLISHED, *subscribed(meshes))),
        (node.resolve_service_name, SERVICES),
    ):
        for name in names:
            try:
                resolve(name)
            except RuntimeError as error:  # rclpy's; the names themselves are sound: what is left is their length
                return (
                    f"{shortened(name)}: in namespace {shortened(node.get_namespace())} and with the remappings given, "
                    f"this name cannot be used ({_reason(error)}); give a shorter mesh name, namespace or remapping"
                )
    return None


def _reason(error: RuntimeError) -> str:
    # "failed to resolve name: REASON, at SOURCE": the limit is 247 characters.
    return str(error).removeprefix("failed to resolve name: ").partition(", at ")[0].replace("255U - 8U", "247")
