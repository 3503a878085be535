# SPDX-License-Identifier: Apache-2.0
"""The ROS node of a command, and the hpccd nodes that it finds."""

import contextlib
import time
from collections.abc import Iterator, Sequence

import rclpy
from rcl_interfaces.srv import ListParameters
from rclpy.node import Node

from hpccd_ros.base.errors import UserError
from hpccd_ros.middleware import environment, graph, ros_start, stop_signals
from hpccd_ros.params import node_parameters
from hpccd_ros.params.table import STOP_ROWS

# s that further nodes have to be found once there is one.
SETTLE = 0.5
# s for a node to list its parameters.
PATIENCE = 2.0
_START = "start one (hpccd_node --ros-args --params-file FILE), or "


@contextlib.contextmanager
def peer(command: str) -> Iterator[tuple[Node, list[int]]]:
    """A hidden node for a command, and the list that SIGINT and SIGTERM fill."""
    environment.prepare()
    with stop_signals.collected() as stop:
        ros_start.init(["hpccd"])
        try:
            node = rclpy.create_node(f"_hpccd_{command}", start_parameter_services=False, enable_rosout=False)
            try:
                yield node, stop
            finally:
                node.destroy_node()
        finally:
            rclpy.try_shutdown()


def chosen(node: Node, wanted: str, wait: float, stop: Sequence) -> str:
    """The full name of the node ``wanted``; "": of the only hpccd node. Raises UserError."""
    found = [_await_node(node, wanted, wait, stop)] if wanted else hpccd_nodes(node, wait, stop)
    if len(found) > 1:
        raise UserError(f"several hpccd nodes are running: {', '.join(found)}; name one with --node")
    if why := graph.same_name(node, found[0]):
        raise UserError(f"{why}; a node that was killed counts for some seconds")
    return found[0]


def hpccd_nodes(node: Node, wait: float, stop: Sequence) -> list[str]:
    """Full names of the hpccd nodes, configured or not. Raises UserError if there is none for ``wait`` s."""
    deadline = time.monotonic() + wait
    asked: dict[str, bool] = {}
    settled = None
    while True:
        now = time.monotonic()
        if found := _hpccd_nodes(node, asked, stop):
            settled = settled or now + SETTLE
            if now >= settled:
                return found
        elif now > deadline:
            raise UserError(graph.no_node(node, _START + graph.elsewhere()))
        else:  # a node that was found may end again
            settled = None
        _pause(node, stop)


def _await_node(node: Node, wanted: str, wait: float, stop: Sequence) -> str:
    full = wanted if wanted.startswith("/") else f"/{wanted}"
    deadline = time.monotonic() + wait
    while full not in graph.other_nodes(node):
        if time.monotonic() > deadline:
            raise UserError(graph.no_node(node, f"start it, name another, or {graph.elsewhere()}", full))
        _pause(node, stop)
    return full


def _hpccd_nodes(node: Node, asked: dict[str, bool], stop: Sequence) -> list[str]:
    """asked: nodes that were asked for their parameters, and whether they have ours; is added to."""
    found = []
    for full in graph.other_nodes(node):
        namespace, _, name = full.rpartition("/")
        if graph.detects(node, name, namespace or "/"):
            found.append(full)
        elif graph.has_life_cycle(node, name, namespace or "/"):
            if full not in asked:
                asked[full] = _has_our_parameters(node, full, stop)
            if asked[full]:
                found.append(full)
    return found


def _has_our_parameters(node: Node, full: str, stop: Sequence) -> bool:
    """What tells a node of ours that is not configured from others with a life cycle."""
    deadline = time.monotonic() + PATIENCE
    service = f"{full}/list_parameters"
    try:
        (response,) = node_parameters.call(
            node, ListParameters, service, [ListParameters.Request()], deadline=deadline, remote=full, stop=stop
        )
    except UserError:  # it does not respond: nothing is known of it
        return False
    return {row.name for row in STOP_ROWS} <= set(response.result.names)


def _pause(node: Node, stop: Sequence) -> None:
    if stop:
        raise KeyboardInterrupt
    rclpy.spin_once(node, timeout_sec=0.02)
