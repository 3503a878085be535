# SPDX-License-Identifier: Apache-2.0
"""All parameters of a node as plain values: of one in this process, or of a running one over its services."""

import time

import rclpy
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.parameter import parameter_value_to_python

from hpccd_ros.errors import UserError


def of(node) -> dict:
    """{name: value} of all parameters of `node`, which lives in this process."""
    return {name: _plain(parameter.value) for name, parameter in node.get_parameters_by_prefix("").items()}


def fetch(node, remote: str, wait: float) -> dict:
    """{name: value} of all parameters that are set in the node with the full name `remote`, asked through `node`.

    Raises UserError naming the nodes that are there if `remote` does not answer within `wait` seconds.
    """
    deadline = time.monotonic() + wait
    names = _call(node, ListParameters, f"{remote}/list_parameters", [ListParameters.Request()], deadline, remote)
    # One request for each: a node answers a request for several with nothing if one of them was never set.
    wanted = sorted(names[0].result.names)
    requests = [GetParameters.Request(names=[name]) for name in wanted]
    answers = _call(node, GetParameters, f"{remote}/get_parameters", requests, deadline, remote)
    return {
        name: _plain(parameter_value_to_python(answer.values[0]))
        for name, answer in zip(wanted, answers, strict=True)
        if answer.values
    }


def _call(node, service, name, requests, deadline, remote):
    client = node.create_client(service, name)
    try:
        while not client.service_is_ready():
            if time.monotonic() > deadline:
                raise UserError(f"no node {remote} found{_nodes(node)}: start it, name another with --node, or --wait")
            rclpy.spin_once(node, timeout_sec=0.05)
        results = []
        for request in requests:  # one after the other: the queue of a service holds ten
            future = client.call_async(request)
            rclpy.spin_until_future_complete(node, future, timeout_sec=max(2.0, deadline - time.monotonic()))
            if not future.done():
                raise UserError(f"the node {remote} does not answer the call of {name}")
            results.append(future.result())
        return results
    finally:
        node.destroy_client(client)


def _nodes(node) -> str:
    own = (node.get_name(), node.get_namespace())
    others = sorted({f"{ns.rstrip('/')}/{name}" for name, ns in node.get_node_names_and_namespaces()
                     if (name, ns) != own})
    return f" (there are: {', '.join(others)})" if others else " (no other node is running)"


def _plain(value):
    # Array parameters arrive as array.array or tuples: JSON and comparison want lists.
    return value if value is None or isinstance(value, (bool, int, float, str)) else list(value)
