# SPDX-License-Identifier: Apache-2.0
"""`hpccd lifecycle`: the life-cycle state of a running node, over its services."""

import time
from typing import Any

from lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState

from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import listed
from hpccd_ros.introspection import peer
from hpccd_ros.params import node_parameters


def main(args) -> int:
    """Do what ``args.action`` says and print the state; 0, or 1 if the transition failed."""
    with peer.peer("lifecycle") as (node, stop):
        name = peer.chosen(node, args.node, args.wait, stop)
        deadline = time.monotonic() + args.wait

        def ask(service: type, what: str, request: Any) -> Any:
            (response,) = node_parameters.call(
                node, service, f"{name}/{what}", [request], deadline=deadline, remote=name, stop=stop
            )
            return response

        def state() -> str:
            return ask(GetState, "get_state", GetState.Request()).current_state.label

        done = True
        if args.action != "get":
            request = GetAvailableTransitions.Request()
            available = ask(GetAvailableTransitions, "get_available_transitions", request).available_transitions
            numbers = {one.transition.label: one.transition.id for one in available}
            if args.action not in numbers:
                raise UserError(f"{args.action}: {name} is {state()}; it can {listed(sorted(numbers))}")
            change = ChangeState.Request()
            change.transition.id = numbers[args.action]
            done = ask(ChangeState, "change_state", change).success
        print(f"{name}: {state()}")
        return 0 if done else 1
