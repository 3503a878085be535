# SPDX-License-Identifier: Apache-2.0
"""All parameters of a node as plain values: of one in this process, or of a running one over its services.

`call` asks any service of another node, in bounded time."""

import functools
import time
from collections.abc import Sequence

import rclpy
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.parameter import parameter_value_to_python

from hpccd_ros.base.errors import UserError
from hpccd_ros.middleware import graph

# s; twice as long each time, as a slow node would be flooded. A response is lost if the node discovers the client only
# after it has responded. Once a client has received one, no later one is lost for that reason.
ASK_AGAIN = 1.0


def of(node) -> dict:
    """{name: value} of all parameters of `node`, which lives in this process."""
    return {name: _plain(parameter.value) for name, parameter in node.get_parameters_by_prefix("").items()}


def fetch(node, remote: str, wait: float, stop: Sequence = ()) -> dict:
    """{name: value} of all parameters that are set in the node with the full name `remote`, asked through `node`.

    Raises UserError naming the nodes that are there if `remote` does not respond within `wait` seconds, and
    KeyboardInterrupt once there is something in `stop`, which a signal's handler may see to.
    """
    deadline = time.monotonic() + wait
    ask = functools.partial(call, node, deadline=deadline, remote=remote, stop=stop)
    names = ask(ListParameters, f"{remote}/list_parameters", [ListParameters.Request()])
    # One request for each: a node returns nothing for a request for several if one of them was never set.
    wanted = sorted(names[0].result.names)
    requests = [GetParameters.Request(names=[name]) for name in wanted]
    responses = ask(GetParameters, f"{remote}/get_parameters", requests)
    return {
        name: _plain(parameter_value_to_python(response.values[0]))
        for name, response in zip(wanted, responses, strict=True)
        if response.values
    }


def call(node, service, name, requests, *, deadline, remote, stop=()):
    """The responses of the service ``name`` of the node ``remote`` to ``requests``, one after the other. deadline: in
    time.monotonic(), for the service to appear. Raises as `fetch`."""
    client = node.create_client(service, name)
    try:
        while not client.service_is_ready():
            if time.monotonic() > deadline:
                raise UserError(graph.no_node(node, "start it, name another, or wait longer (--wait)", remote))
            _spin_once(node, stop)
        results = []
        for request in requests:  # one after the other: the queue of a service holds ten
            asked, futures = time.monotonic(), [client.call_async(request)]
            patience = max(deadline, asked + 2.0)
            while not (ready := [future for future in futures if future.done()]):
                if time.monotonic() > patience:
                    raise UserError(f"{name}: the node {remote} does not respond; wait, or start it again")
                if not results and time.monotonic() > asked + ASK_AGAIN * (2 ** len(futures) - 1):
                    futures.append(client.call_async(request))
                _spin_once(node, stop)
            results.append(ready[0].result())
            # A slow node responds to the copies before the next request: that time is not the next one's.
            now = time.monotonic()
            copies_end = now + (now - asked) * (len(futures) - 1)
            while time.monotonic() < copies_end and not all(future.done() for future in futures):
                _spin_once(node, stop)
        return results
    finally:
        node.destroy_client(client)


def _spin_once(node, stop) -> None:
    # An exception of a signal's handler inside of rclpy's calls would come out as another one.
    if stop:
        raise KeyboardInterrupt
    rclpy.spin_once(node, timeout_sec=0.05)


def _plain(value):
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    # Array parameters arrive as array.array or tuples: JSON and comparison want lists.
    plain = list(value)
    return [] if plain == [""] else plain  # YAML parameters know no empty list
