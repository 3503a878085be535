# SPDX-License-Identifier: Apache-2.0
"""rclpy's services that set parameters, with a check that they lack: of the type that a value claims to have."""

from rcl_interfaces.msg import Parameter, SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy import parameter
from rclpy.node import Node

TYPES = {kind.value for kind in parameter.Parameter.Type}


def refuse_unknown_types(node: Node) -> None:
    """Values of a type that does not exist are refused with a reason; rclpy 7.1 raises, and nobody is answered."""
    for service in node.services:
        if service.srv_type is SetParameters:
            service.callback = _each(service.callback)
        elif service.srv_type is SetParametersAtomically:
            service.callback = _all(service.callback)


def _each(set_parameters):
    def answer(request: SetParameters.Request, response: SetParameters.Response) -> SetParameters.Response:
        for given in request.parameters:
            if (refused := _refusal(given)) is None:
                one = SetParameters.Request(parameters=[given])
                response.results += set_parameters(one, SetParameters.Response()).results
            else:
                response.results.append(refused)
        return response

    return answer


def _all(set_atomically):
    def answer(
        request: SetParametersAtomically.Request, response: SetParametersAtomically.Response
    ) -> SetParametersAtomically.Response:
        for given in request.parameters:
            if (refused := _refusal(given)) is not None:
                response.result = refused
                return response
        return set_atomically(request, response)

    return answer


def _refusal(given: Parameter) -> SetParametersResult | None:
    if given.value.type in TYPES:
        return None
    reason = f"{given.name}: {given.value.type} is no type of rcl_interfaces/msg/ParameterType"
    return SetParametersResult(successful=False, reason=reason)
