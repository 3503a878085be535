# SPDX-License-Identifier: Apache-2.0
"""The parameters of a node: declared with their descriptors, and watched while it runs. Made from table.py."""

import copy
import itertools
from collections.abc import Callable, Iterable
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, ParameterType, SetParametersResult
from rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterUninitializedException,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from hpccd_ros.base import quoting
from hpccd_ros.params.parameter_file import parameter_value, without_section
from hpccd_ros.params.table import MESH_ROWS, NEVER, NODE_ROWS, PAIRS, PLANE, ROBOT, UNCONFIGURED, Row
from hpccd_ros.params.values import (
    ParameterError,
    allowed,
    check_names,
    expected,
    normalise,
    pair_names,
    pair_rows,
    plane_rows,
    robot_rows,
    unusable_value,
    usable,
)

_TYPES = {
    "bool": ParameterType.PARAMETER_BOOL,
    "int": ParameterType.PARAMETER_INTEGER,
    "float": ParameterType.PARAMETER_DOUBLE,
    "string": ParameterType.PARAMETER_STRING,
    "string[]": ParameterType.PARAMETER_STRING_ARRAY,
    "float[]": ParameterType.PARAMETER_DOUBLE_ARRAY,
}


# ROS reads a number without a decimal point as an integer; it is accepted as a float.
_INTEGERS = {"float": Parameter.Type.INTEGER, "float[]": Parameter.Type.INTEGER_ARRAY}


def descriptor(row: Row) -> ParameterDescriptor:
    """The result of ``describe_parameters``."""
    out = ParameterDescriptor(name=row.name, type=_TYPES[row.kind], description=row.text, read_only=row.change == NEVER)
    if row.unit:
        out.description += f" [{row.unit}]"
    if row.choices:
        out.additional_constraints = "one of " + ", ".join(row.choices)
    elif row.least is not None:
        out.additional_constraints = f"{row.span[0]:g} or at least {row.least:g}"
    if row.span is not None and row.kind == "int":
        out.integer_range = [IntegerRange(from_value=int(row.span[0]), to_value=int(row.span[1]), step=1)]
    elif row.span is not None:
        out.floating_point_range = [FloatingPointRange(from_value=row.span[0], to_value=row.span[1], step=0.0)]
    return out


def declare(node: Node) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """Declare all parameters of the table; return (node settings, mesh name -> mesh settings) as `values.checked` does.

    Raises ParameterError: wrong type, out of range, bad or repeated name of a mesh, robot or plane, unknown parameter
    of a pair.
    """
    settings = {row.name: _declare_one(node, row, row.name) for row in NODE_ROWS}
    names = settings["meshes"]
    check_names(settings)
    settings[ROBOT] = {
        robot: {row.name: _declare_one(node, row, name) for row, name in robot_rows(robot)}
        for robot in settings["robots"]
    }
    settings[PLANE] = {
        plane: {row.name: _declare_one(node, row, name) for row, name in plane_rows(plane)}
        for plane in settings["planes"]
    }
    settings[PAIRS] = {
        pair: {row.name: _declare_one(node, row, name) for row, name in pair_rows(pair)}
        for pair in pair_names(_given(node))
    }
    meshes = {
        name: {row.name: _declare_one(node, row, f"mesh.{name}.{row.name}") for row in MESH_ROWS} for name in names
    }
    return settings, meshes


def _declare_one(node: Node, row: Row, name: str) -> Any:
    # An empty list has no element type, so rclpy would declare it as a byte array: declare the type instead, like one
    # that need not be set.
    typed = row.kind == "string[]" or row.default in (None, [])
    value = Parameter.Type(_TYPES[row.kind]) if typed else row.default
    given = _given(node).get(name)
    whole = given is not None and given.type_ == _INTEGERS.get(row.kind)
    if whole:
        value = normalise(row, given.value)
    try:
        node.declare_parameter(name, value, descriptor(row), ignore_override=whole)
        value = node.get_parameter(name).value
    except ParameterUninitializedException:
        value = None if given is not None else row.default  # an empty list in YAML is no value of any type
    except InvalidParameterTypeException as error:
        raise ParameterError(f"{name}: {quoting.quoted(given.value)} is of the wrong type; {expected(row)}") from error
    except InvalidParameterValueException as error:
        raise ParameterError(f"{name}: {quoting.shortened(error, 300)}; allowed {allowed(row)}") from error
    return usable(row, name, value)


def unknown_overrides(node: Node) -> list[str]:
    """Parameters given on the command line or in a file that the node does not have."""
    return sorted(name for name in _given(node) if not node.has_parameter(name))


def check_command_line(node: Node, arguments: list[str]) -> None:
    """Raises ParameterError for a value on the command line that rcl leaves out.

    If a file gives the parameter with another type, rcl 9 keeps both values and takes the bool, integer or float, so
    that `-p stop_distance:=5cm` would be without effect.
    """
    given = _given(node)
    for option, assignment in itertools.pairwise(arguments):
        name, assigned, text = assignment.partition(":=")
        name = name.rpartition(":")[2]
        if option not in ("-p", "--param") or not assigned or name not in given:
            continue
        value, in_force = parameter_value(text), given[name].value
        if isinstance(value, str) and not isinstance(in_force, str):
            raise ParameterError(
                f"{name}: {quoting.quoted(text)} on the command line has not the type of {in_force!r} in the parameter "
                "file, and ROS would leave it out; write a value of that type"
            )


def files_without_section(node: Node, arguments: list[str]) -> list[str]:
    """The warnings about parameter files on the command line that have no section for this node."""
    name = node.get_fully_qualified_name()
    files = (file for option, file in itertools.pairwise(arguments) if option == "--params-file")
    return [warning for file in files if (warning := without_section(file, name))]


def _given(node: Node) -> dict[str, Parameter]:
    return getattr(node, "_parameter_overrides", {})  # rclpy has no public list of given parameters


def watch(
    node: Node,
    settings: dict[str, Any],
    meshes: dict[str, dict[str, Any]],
    *,
    configured: Callable[[], bool],
    check: Callable[[dict[str, Any], dict[str, dict[str, Any]]], str | None],
    on_change: Callable[[], None],
) -> None:
    """Update ``settings`` and ``meshes`` at run time; reject invalid changes with a reason.

    configured: whether the life cycle is past `unconfigured`; then only rows with ALWAYS may change.
    check: called with settings and meshes as they would be; returns why they cannot be used, or None.
    on_change: called after each accepted change of a row; other parameters (qos_overrides, use_sim_time) are rclpy's.
    """
    rows = {row.name: (lambda wanted, _: wanted, row) for row in NODE_ROWS}
    for mesh in meshes:
        rows |= {f"mesh.{mesh}.{row.name}": (lambda _, of, mesh=mesh: of[mesh], row) for row in MESH_ROWS}
    for part, named_rows in ((PAIRS, pair_rows), (ROBOT, robot_rows), (PLANE, plane_rows)):
        for each in settings[part]:
            rows |= {
                name: (lambda wanted, _, part=part, each=each: wanted[part][each], row)
                for row, name in named_rows(each)
            }

    def on_set(parameters: Iterable[Parameter]) -> SetParametersResult:
        wanted, wanted_meshes = copy.deepcopy((settings, meshes))
        ours = [parameter for parameter in parameters if parameter.name in rows]
        if not ours:
            return SetParametersResult(successful=True)
        for parameter in ours:
            part, row = rows[parameter.name]
            values = part(wanted, wanted_meshes)
            value = normalise(row, parameter.value)
            if row.change == UNCONFIGURED and configured() and value != values[row.name]:
                reason = (
                    f"{parameter.name}: read-only while the node is configured; run hpccd lifecycle deactivate, then "
                    "cleanup"
                )
                return SetParametersResult(successful=False, reason=reason)
            if reason := unusable_value(row, value):
                return SetParametersResult(successful=False, reason=reason.replace(row.name, parameter.name, 1))
            values[row.name] = value
        if reason := check(wanted, wanted_meshes):
            return SetParametersResult(successful=False, reason=reason)
        settings.update(wanted)
        for name, values in wanted_meshes.items():
            meshes[name].update(values)
        on_change()
        return SetParametersResult(successful=True)

    node.add_on_set_parameters_callback(on_set)
