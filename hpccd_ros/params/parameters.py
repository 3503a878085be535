# SPDX-License-Identifier: Apache-2.0
"""The parameters of the node: descriptors and checks, made from table.py."""

import re
from collections.abc import Callable, Container, Iterable
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    ParameterType,
    SetParametersResult,
)
from rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterUninitializedException,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from hpccd_ros.base import quoting
from hpccd_ros.params.table import MESH_ROWS, NEVER, NODE_ROWS, UNCONFIGURED, Row

_TYPES = {
    "bool": ParameterType.PARAMETER_BOOL,
    "int": ParameterType.PARAMETER_INTEGER,
    "float": ParameterType.PARAMETER_DOUBLE,
    "string": ParameterType.PARAMETER_STRING,
    "string[]": ParameterType.PARAMETER_STRING_ARRAY,
    "float[]": ParameterType.PARAMETER_DOUBLE_ARRAY,
}


class ParameterError(ValueError):
    """A parameter that the node cannot start with; the text names it and the remedy."""


# A mesh name becomes part of topic and parameter names.
_MESH_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def unusable_value(row: Row, value: Any) -> str | None:
    """Why ``value`` (of the right type) cannot be used, or None."""
    if row.span is not None and not row.span[0] <= value <= row.span[1]:
        return f"{row.name}: {value} is outside {row.span[0]} .. {row.span[1]}"
    if row.least and 0 < value < row.least:
        return f"{row.name}: {value} is neither 0 nor at least {row.least:g}"
    entries = value if row.kind == "string[]" else [value]
    if row.choices:
        for entry in entries:
            if entry not in row.choices:
                return f"{row.name}: {quoting.quoted(entry)} is none of {', '.join(row.choices)}"
    return None


def checked(given: dict[str, Any]) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """What ``declare`` returns for a node with the parameters ``given``, by full name, from a file. None: not set.

    Raises ParameterError: as ``declare``.
    """
    settings = {row.name: _checked_value(row, row.name, given.get(row.name)) for row in NODE_ROWS}
    _check_names(settings["meshes"])
    of_mesh = {mesh: f"mesh.{mesh}." for mesh in settings["meshes"]}
    meshes = {
        mesh: {row.name: _checked_value(row, prefix + row.name, given.get(prefix + row.name)) for row in MESH_ROWS}
        for mesh, prefix in of_mesh.items()
    }
    return settings, meshes


_PLAIN = {"bool": bool, "int": int, "float": float, "string": str}


def _checked_value(row: Row, name: str, value: Any) -> Any:
    if value is None:
        return normalise(row, row.default)
    is_list = row.kind.endswith("[]") and isinstance(value, list)
    entries, kind = (value, row.kind[:-2]) if is_list else ([value], row.kind)
    # Not isinstance: True is an int.
    if not all(type(entry) is _PLAIN.get(kind) for entry in entries):
        raise ParameterError(f"{name}: {value!r} is of the wrong type; expected {row.kind}, e.g. {row.default!r}")
    value = normalise(row, value)
    if reason := unusable_value(row, value):
        raise ParameterError(reason.replace(row.name, name, 1))
    return value


def descriptor(row: Row) -> ParameterDescriptor:
    """What ``describe_parameters`` shows."""
    out = ParameterDescriptor(name=row.name, type=_TYPES[row.kind], description=row.text, read_only=row.change == NEVER)
    if row.unit:
        out.description += f" [{row.unit}]"
    if row.choices:
        out.additional_constraints = "one of " + ", ".join(row.choices)
    elif row.least:
        out.additional_constraints = f"0 or at least {row.least:g}"
    if row.span is not None and row.kind == "int":
        out.integer_range = [IntegerRange(from_value=int(row.span[0]), to_value=int(row.span[1]), step=1)]
    elif row.span is not None:
        out.floating_point_range = [FloatingPointRange(from_value=row.span[0], to_value=row.span[1], step=0.0)]
    return out


def declare(node: Node) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """Declare all parameters of the table; return (node settings, mesh name -> mesh settings).

    Raises ParameterError: wrong type, out of range, bad or repeated mesh name.
    """
    settings = {row.name: _declare_one(node, row, row.name) for row in NODE_ROWS}
    names = settings["meshes"]
    _check_names(names)
    meshes = {
        name: {row.name: _declare_one(node, row, f"mesh.{name}.{row.name}") for row in MESH_ROWS} for name in names
    }
    return settings, meshes


def _check_names(names: list[str]) -> None:
    for name in names:
        if not _MESH_NAME.fullmatch(name):
            raise ParameterError(
                f"meshes: {quoting.quoted(name)} cannot be part of a topic name; use letters, digits and _, a "
                "letter first"
            )
    if len(set(names)) != len(names):
        raise ParameterError(f"meshes: names must differ, {quoting.repeated(names)} is there twice")


def _declare_one(node: Node, row: Row, name: str) -> Any:
    # An empty list has no element type, so rclpy would declare it as a byte array: declare the type instead.
    value = Parameter.Type.STRING_ARRAY if row.kind == "string[]" else row.default
    try:
        node.declare_parameter(name, value, descriptor(row))
        value = node.get_parameter(name).value
    except ParameterUninitializedException:
        return list(row.default)
    except InvalidParameterTypeException as error:
        raise ParameterError(
            f"{name}: {quoting.shortened(error, 300)}; expected {row.kind}, e.g. {row.default!r}"
        ) from error
    except InvalidParameterValueException as error:
        raise ParameterError(f"{name}: {quoting.shortened(error, 300)}; allowed {allowed(row)}") from error
    value = normalise(row, value)
    if reason := unusable_value(row, value):
        raise ParameterError(reason.replace(row.name, name, 1))
    return value


def normalise(row: Row, value: Any) -> Any:
    """Plain Python value. YAML and the command line cannot write an empty list of strings: [""] is one."""
    if row.kind == "string[]":
        return [entry for entry in value or [] if entry]
    return list(value) if row.kind == "float[]" else value


def unknown_overrides(node: Node, qos_overrides: Container[str] = ()) -> list[str]:
    """Parameters given on the command line or in a file that the node does not have: usually misspelt.

    qos_overrides: names of those that are declared only when their topics are there.
    """
    given = getattr(node, "_parameter_overrides", {})  # rclpy has no public list of what was given
    return sorted(name for name in given if not node.has_parameter(name) and name not in qos_overrides)


# Of every node.
_ROS_OWN = ("use_sim_time", "start_type_description_service")


def unknown(given: Iterable[str], meshes: Iterable[str]) -> list[str]:
    """Those of the names ``given`` that a node of these meshes would not have."""
    rows = {row.name for row in NODE_ROWS} | {f"mesh.{mesh}.{row.name}" for mesh in meshes for row in MESH_ROWS}
    return sorted(n for n in given if n not in rows and n not in _ROS_OWN and not n.startswith("qos_overrides."))


def watch(
    node: Node,
    settings: dict[str, Any],
    meshes: dict[str, dict[str, Any]],
    *,
    configured: Callable[[], bool],
    check: Callable[[dict[str, Any], dict[str, dict[str, Any]]], str | None],
    on_change: Callable[[], None],
) -> None:
    """Keep ``settings`` and ``meshes`` up to date with changes at run time; refuse bad ones with a reason.

    configured: whether the life cycle is past `unconfigured`; then only rows that may always change do.
    check: called with settings and meshes as they would be; returns why they cannot be used, or None.
    on_change: called after each accepted change of a row; other parameters (qos_overrides, use_sim_time) are rclpy's.
    """
    rows = {row.name: (None, row) for row in NODE_ROWS}
    rows |= {f"mesh.{name}.{row.name}": (name, row) for name in meshes for row in MESH_ROWS}

    def on_set(parameters: Iterable[Parameter]) -> SetParametersResult:
        wanted, wanted_meshes = dict(settings), {name: dict(values) for name, values in meshes.items()}
        ours = [parameter for parameter in parameters if parameter.name in rows]
        if not ours:
            return SetParametersResult(successful=True)
        for parameter in ours:
            mesh, row = rows[parameter.name]
            values = wanted if mesh is None else wanted_meshes[mesh]
            value = normalise(row, parameter.value)
            if row.change == UNCONFIGURED and configured() and value != values[row.name]:
                reason = f"{parameter.name}: read-only while the node is configured; deactivate and clean up first"
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


def allowed(row: Row) -> str:
    """The allowed values in Markdown; empty: any of the type."""
    if row.choices:
        return ", ".join(f"`{choice}`" for choice in row.choices)
    if row.least:
        return f"0, {row.least:g} .. {row.span[1]:,}"
    if row.span is not None:
        return f"{row.span[0]:,} .. {row.span[1]:,}"
    return ""
