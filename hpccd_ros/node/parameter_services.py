# SPDX-License-Identifier: Apache-2.0
"""rclpy's services that set parameters, with what they lack: a check of the type that a value claims to have, integers
where floats are wanted, and words for names that the node does not have."""

from rcl_interfaces.msg import Parameter, ParameterDescriptor, ParameterType, ParameterValue, SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy import parameter
from rclpy.node import Node

from hpccd_ros.params import values

TYPES = {kind.value for kind in parameter.Parameter.Type}
# As in docs/parameters.md.
_WORDS = {
    ParameterType.PARAMETER_BOOL: "bool",
    ParameterType.PARAMETER_INTEGER: "int",
    ParameterType.PARAMETER_DOUBLE: "float",
    ParameterType.PARAMETER_STRING: "string",
    ParameterType.PARAMETER_BYTE_ARRAY: "byte[]",
    ParameterType.PARAMETER_BOOL_ARRAY: "bool[]",
    ParameterType.PARAMETER_INTEGER_ARRAY: "int[]",
    ParameterType.PARAMETER_DOUBLE_ARRAY: "float[]",
    ParameterType.PARAMETER_STRING_ARRAY: "string[]",
}


def replace_callbacks(node: Node) -> None:
    """Values of a type that does not exist are rejected with a reason; rclpy 7.1 raises without a response.
    Integers become floats where the parameter is one: `ros2 param set` takes a number without a point for an integer.
    """
    for service in node.services:
        if service.srv_type is SetParameters:
            service.callback = _each(node, service.callback)
        elif service.srv_type is SetParametersAtomically:
            service.callback = _all(node, service.callback)


def _each(node, set_parameters):
    def respond(request: SetParameters.Request, response: SetParameters.Response) -> SetParameters.Response:
        for given in request.parameters:
            if (rejected := _rejection(node, given)) is None:
                one = SetParameters.Request(parameters=[_as_declared(node, given)])
                response.results += set_parameters(one, SetParameters.Response()).results
            else:
                response.results.append(rejected)
        return response

    return respond


def _all(node, set_atomically):
    def respond(
        request: SetParametersAtomically.Request, response: SetParametersAtomically.Response
    ) -> SetParametersAtomically.Response:
        for given in request.parameters:
            if (rejected := _rejection(node, given)) is not None:
                response.result = rejected
                return response
        request.parameters = [_as_declared(node, given) for given in request.parameters]
        return set_atomically(request, response)

    return respond


def _rejection(node: Node, given: Parameter) -> SetParametersResult | None:
    if given.value.type not in TYPES:
        reason = f"{given.name}: type {given.value.type} is not valid; use one of rcl_interfaces/msg/ParameterType"
    elif not node.has_parameter(given.name):
        reason = values.undeclared(given.name, node.list_parameters([], 0).names)
    elif wrong := _wrong_type(node.describe_parameter(given.name), _as_declared(node, given).value.type):
        row = values.row_of(given.name)
        example = row and values.example(row)
        remedy = f"write, for example, {example}" if example else "docs/parameters.md has the type of each parameter"
        reason = f"{given.name}: {wrong}; {remedy}"
    else:
        return None
    return SetParametersResult(successful=False, reason=reason)


def _wrong_type(wanted: ParameterDescriptor, given: int) -> str:
    if given in (wanted.type, ParameterType.PARAMETER_NOT_SET) or wanted.dynamic_typing:
        return ""
    return f"expected {_WORDS[wanted.type]}, got {_WORDS[given]}"


def _as_declared(node: Node, given: Parameter) -> Parameter:
    wanted = node.describe_parameter(given.name).type if node.has_parameter(given.name) else None
    value = given.value
    if (wanted, value.type) == (ParameterType.PARAMETER_DOUBLE, ParameterType.PARAMETER_INTEGER):
        return Parameter(name=given.name, value=ParameterValue(type=wanted, double_value=float(value.integer_value)))
    if (wanted, value.type) == (ParameterType.PARAMETER_DOUBLE_ARRAY, ParameterType.PARAMETER_INTEGER_ARRAY):
        floats = [float(entry) for entry in value.integer_array_value]
        return Parameter(name=given.name, value=ParameterValue(type=wanted, double_array_value=floats))
    return given
