# SPDX-License-Identifier: Apache-2.0
"""Services of a NodeProcess as functions, and a stream of frames with its results."""

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from waving_sheet import sheet_positions

N = 8


def call(node, kind, name, request):
    client = node.peer.node.create_client(kind, f"hpccd/{name}")
    node.wait_until(client.service_is_ready, f"service {name}")
    future = client.call_async(request)
    node.wait_until(future.done, f"result of {name}")
    return future.result()


def change_state(node, transition):
    return call(node, ChangeState, "change_state", ChangeState.Request(transition=Transition(id=transition))).success


def set_parameter(node, name, value):
    request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
    return call(node, SetParameters, "set_parameters", request).results[0]


def stream(node, steps, start=0):
    for k in steps:
        node.peer.vertices("cloth", sheet_positions(N, k), start + k)
        node.contacts(max(0, k))


def state(node):
    return call(node, GetState, "get_state", GetState.Request()).current_state.label
