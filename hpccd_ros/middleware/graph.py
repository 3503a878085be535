# SPDX-License-Identifier: Apache-2.0
"""The graph of nodes and topics, as discovery knows it in this process."""

import os
from collections.abc import Iterable
from typing import Any

from rclpy._rclpy_pybind11 import RCLError
from rclpy.node import Node, NodeNameNonExistentError

from hpccd_ros.base.quoting import listed, nearest, shortened, suggestion
from hpccd_ros.middleware import environment

_DETECT = "hpccd/srv/Detect"
_GET_STATE = "lifecycle_msgs/srv/GetState"


def full_name(name: str, namespace: str) -> str:
    """Full name of a node."""
    return f"{namespace.rstrip('/')}/{name}"


def other_nodes(node: Node) -> list[str]:
    """Full names of all nodes but ``node`` and hidden ones, whose name begins with an underscore."""
    own = (node.get_name(), node.get_namespace())
    found = node.get_node_names_and_namespaces()
    return sorted({full_name(*one) for one in found if one != own and not one[0].startswith("_")})


def same_name(node: Node, full: str) -> str:
    """That several nodes have this full name, and the remedy; "": one has, or none."""
    count = sum(full_name(*one) == full for one in node.get_node_names_and_namespaces())
    if count < 2:
        return ""
    return f"{count} nodes are named {full}, so they share topics and services; end one, or rename it (-r __node:=NAME)"


def services(node: Node, name: str, namespace: str) -> dict[str, list[str]]:
    """Service -> its types, of a node; none where the node has gone, is not known yet, or is not a ROS node."""
    try:
        return dict(node.get_service_names_and_types_by_node(name, namespace))
    except (NodeNameNonExistentError, RCLError):
        return {}


def detects(node: Node, name: str, namespace: str) -> bool:
    """Whether a node has a service of type hpccd/srv/Detect, as each configured hpccd node does."""
    return any(_DETECT in types for types in services(node, name, namespace).values())


def has_life_cycle(node: Node, name: str, namespace: str) -> bool:
    """Whether a node has the life-cycle services."""
    return _GET_STATE in services(node, name, namespace).get(f"{full_name(name, namespace)}/get_state", ())


def endpoint_node(endpoint: Any) -> str:
    """In words, the node of a publisher or subscription."""
    if endpoint.node_name == "_NODE_NAME_UNKNOWN_":  # ROS discovers nodes after their publishers
        return "whose node is not known yet"
    if endpoint.node_name == "_CREATED_BY_BARE_DDS_APP_":
        return "that is not a ROS node"
    return f"of node {shortened(full_name(endpoint.node_name, endpoint.node_namespace))}"


def published(node: Node, type_name: str) -> set[str]:
    """Full names of the topics of this type that have publishers."""
    return {
        name for name, types in node.get_topic_names_and_types() if type_name in types and node.count_publishers(name)
    }


def near_published(node: Node, topic: str, type_name: str) -> str:
    """A topic of this type that has publishers, and is spelled as ``topic`` (full name) or has the same last part, in
    its namespace if there is one; "": there is none."""
    everywhere = published(node, type_name) - {topic}
    namespace, _, last = topic.rpartition("/")
    for there in ([name for name in everywhere if name.startswith(f"{namespace}/")], everywhere):
        alike = (name for name in there if name.rpartition("/")[2] == last)
        if near := nearest(topic, there) or min(alike, default=""):
            return near
    return ""


def near_topic(node: Node, topic: str, type_name: str, parameters: Iterable[str]) -> str:
    """For the end of a warning that ``topic`` (full name) has no publisher: `near_published`, and the remedies. The
    parameters name the topic."""
    near = near_published(node, topic, type_name)
    if not near:
        return ""
    settings = " and ".join(f"{parameter}: {near}" for parameter in parameters)
    return f"; {near} has publishers: if that is meant, set {settings}, or start the node with -r {topic}:={near}"


def no_node(node: Node, remedy: str, wanted: str = "") -> str:
    """That no node ``wanted`` (full name; "": no hpccd node) is found, which others there are, and the remedy; or that
    ``wanted`` is no hpccd node."""
    others = other_nodes(node)
    if wanted in others:
        return f"node {wanted}: it offers no services of an hpccd node; name another, or wait longer (--wait)"
    there = f" (there are: {listed(others)})" if others else " (no other node is running)"
    near = suggestion(wanted, others) if wanted else ""
    return f"no {f'node {wanted}' if wanted else 'hpccd node'} found on {domain()}{there}; {remedy}{near}"


def domain() -> str:
    """The DDS domain of this process, in words."""
    return f"ROS_DOMAIN_ID {os.environ.get('ROS_DOMAIN_ID') or 0}"


def elsewhere() -> str:
    """How to reach a node on another domain or machine."""
    beyond = f", and {environment.DISCOVERY}=SUBNET if it is on another machine" if environment.this_host_only() else ""
    return f"set ROS_DOMAIN_ID to that of the node{beyond}"
