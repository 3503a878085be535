# SPDX-License-Identifier: Apache-2.0
"""`hpccd param`: the parameters of a running node, over its services."""

import time
from collections.abc import Sequence
from typing import Any

import yaml
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter

from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import shortened, suggestion
from hpccd_ros.introspection import peer
from hpccd_ros.params import node_parameters, parameter_file


def main(args) -> int:
    """Do what ``args.action`` says; 0."""
    with peer.peer("param") as (node, stop):
        name = peer.chosen(node, args.node, args.wait, stop)
        if args.action == "set":
            _set(node, name, args, stop)
            return 0
        found = node_parameters.fetch(node, name, args.wait, stop)
    if args.action == "get":
        if args.name not in found:
            raise UserError(
                f"{shortened(args.name)}: {name} has no such parameter, or it has no value; `hpccd param list` shows "
                f"all{suggestion(args.name, found)}"
            )
        print(_yaml(found[args.name]))
        return 0
    begins = args.name or ""
    shown = {key: value for key, value in found.items() if key == begins or key.startswith(begins)}
    if not shown:
        raise UserError(f"{shortened(begins)}: no parameter of {name} begins so{suggestion(begins, found)}")
    for key, value in shown.items():
        print(f"{key}: {_yaml(value)}")
    return 0


def _set(node: Node, remote: str, args, stop: Sequence) -> None:
    value = parameter_file.value(args.value)
    given = Parameter(args.name, value=value).to_parameter_msg()
    (response,) = node_parameters.call(
        node,
        SetParameters,
        f"{remote}/set_parameters",
        [SetParameters.Request(parameters=[given])],
        deadline=time.monotonic() + args.wait,
        remote=remote,
        stop=stop,
    )
    (result,) = response.results
    if not result.successful:
        reason = result.reason or f"{remote} gives no reason"
        if reason.startswith("Trying to set a read-only parameter"):  # rclpy
            reason = f"{args.name}: read-only; give it when the node starts"
        raise UserError(f"not set: {reason}")
    print(f"{args.name}: {_yaml(value)}")


def _yaml(value: Any) -> str:
    """On one line."""
    text = yaml.safe_dump(value, default_flow_style=True, width=float("inf"), allow_unicode=True)
    return text.removesuffix("\n").removesuffix("\n...")
