# SPDX-License-Identifier: Apache-2.0
"""The parameters of the node: one table, from which descriptors, checks and the README's table are made.

``python -m hpccd_ros.parameters`` prints the table.
"""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
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


@dataclass(frozen=True)
class Row:
    """One parameter. ``span``: closed range of a number; ``choices``: allowed strings (of each entry)."""

    name: str
    kind: str
    default: Any
    text: str
    unit: str = ""
    span: tuple[float, float] | None = None
    choices: tuple[str, ...] = ()
    changeable: bool = False


ACCURACIES = ("fast", "balanced", "conservative", "exact")
BACKENDS = ("auto", "cpu", "hybrid", "gpu")
REPORTS = ("all", "first", "any")
OUTPUTS = ("points", "normals")

NODE_ROWS = (
    Row(
        "meshes",
        "string[]",
        [],
        "Names of the meshes of the scene, in the order of the core's numbering. Each name "
        "makes the topics meshes/NAME/... and the parameters mesh.NAME.*",
    ),
    Row(
        "ignored_pairs",
        "string[]",
        [],
        "Pairs of meshes that are never tested against each other, each as NAME:NAME",
    ),
    Row("autostart", "bool", True, "Configure and activate at once; false: wait for the life-cycle services"),
    Row("accuracy", "string", "balanced", "Tier of the elementary tests", choices=ACCURACIES, changeable=True),
    Row("backend", "string", "auto", "Where the core runs", choices=BACKENDS, changeable=True),
    Row("threads", "int", 0, "Threads of the core; 0: all cores", span=(0, 1024), changeable=True),
    Row(
        "report",
        "string",
        "all",
        "Every contact, those at the earliest time, or any one",
        choices=REPORTS,
        changeable=True,
    ),
    Row("outputs", "string[]", [], "Computed and sent beside the contacts", choices=OUTPUTS, changeable=True),
    Row(
        "max_contacts",
        "int",
        200_000,
        "Most contacts in one message: the earliest are kept, `truncated` is set; 0: no limit",
        span=(0, 100_000_000),
        changeable=True,
    ),
    Row(
        "frame_id",
        "string",
        "",
        "Coordinate frame that all vertex messages must carry; empty: that of the first one",
    ),
    Row(
        "frame_queue",
        "int",
        1,
        "Complete frames that may wait for the detection; 1: only the latest. The oldest gives "
        "way, counted as overload",
        span=(1, 100_000),
    ),
    Row(
        "pending_frames",
        "int",
        8,
        "Frames of a mesh that may wait for a topology or for other meshes",
        span=(1, 10_000),
    ),
    Row(
        "stamp_match",
        "string",
        "exact",
        "How frames of several meshes are joined: equal stamps, or nearest to those of the first deforming mesh",
        choices=("exact", "nearest"),
    ),
    Row(
        "stamp_tolerance",
        "float",
        0.01,
        "Largest difference of stamps for stamp_match nearest",
        unit="s",
        span=(0.0, 3600.0),
    ),
    Row(
        "restart_after",
        "int",
        5,
        "Frames in a row with increasing stamps before the last accepted one that are taken "
        "as a restart of the stream; 0: never",
        span=(0, 1_000_000),
        changeable=True,
    ),
    Row(
        "input_reliability",
        "string",
        "reliable",
        "QoS of the vertex subscriptions; best_effort also accepts best-effort publishers, and may lose large messages",
        choices=("reliable", "best_effort"),
    ),
    Row(
        "input_depth",
        "int",
        10,
        "QoS history depth of the vertex subscriptions: messages that may come at once without loss",
        span=(1, 1000),
    ),
    Row("max_vertices", "int", 5_000_000, "Largest mesh accepted", unit="vertices", span=(1, 1_000_000_000)),
    Row("max_faces", "int", 10_000_000, "Largest mesh accepted", unit="triangles", span=(1, 1_000_000_000)),
    Row(
        "count_unknown_meshes",
        "bool",
        True,
        "Subscribe (raw) to vertex topics of meshes that are not in `meshes`, to "
        "count their frames; false: only name the topics in the diagnostics",
    ),
    Row("detect_jobs", "int", 2, "Requests of ~/detect that are computed at the same time", span=(1, 256)),
    Row(
        "detect_waiting",
        "int",
        8,
        "Requests of ~/detect that may wait; more are refused as busy",
        span=(0, 10_000),
    ),
    Row(
        "detect_time_limit",
        "float",
        30.0,
        "Answer of ~/detect after this time at the latest, where the request sets no limit",
        unit="s",
        span=(0.001, 86_400.0),
        changeable=True,
    ),
    Row("diagnostics_period", "float", 1.0, "Period of /diagnostics", unit="s", span=(0.05, 3600.0)),
    Row(
        "markers",
        "bool",
        False,
        "Publish contact points and normals as visualization_msgs/MarkerArray on markers",
        changeable=True,
    ),
    Row(
        "markers_max",
        "int",
        2000,
        "Most contacts drawn; evenly thinned out",
        span=(1, 1_000_000),
        changeable=True,
    ),
    Row(
        "markers_rate",
        "float",
        10.0,
        "Most marker messages a second",
        unit="Hz",
        span=(0.001, 1000.0),
        changeable=True,
    ),
    Row(
        "markers_size",
        "float",
        0.01,
        "Diameter of a point; a normal is ten times as long",
        unit="unit of the vertices",
        span=(1e-9, 1e9),
        changeable=True,
    ),
)

MESH_ROWS = (
    Row(
        "input",
        "string",
        "vertices",
        "Topic of the positions: meshes/NAME/vertices (MeshVertices) or meshes/NAME/points (PointCloud2)",
        choices=("vertices", "points"),
    ),
    Row("static", "bool", False, "Does not move: positions from the file or from one message"),
    Row("self_collision", "bool", True, "Test the mesh against itself"),
    Row(
        "file",
        "string",
        "",
        "Mesh file (OBJ, PLY, STL; needs trimesh) with the topology, version 0, and for a static mesh the positions",
    ),
    Row(
        "pose",
        "float[]",
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        "Where the file's vertices are placed: translation x y z, unit quaternion x y z w",
        unit="unit of the vertices",
    ),
)

# A mesh name becomes part of topic and parameter names.
_MESH_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_BY_NAME = {row.name: row for row in NODE_ROWS}


def refusal(row: Row, value: Any) -> str | None:
    """Why ``value`` (of the right type) cannot be used, or None."""
    if row.span is not None and not row.span[0] <= value <= row.span[1]:
        return f"{row.name}: {value} is outside {row.span[0]} .. {row.span[1]}"
    entries = value if row.kind == "string[]" else [value]
    if row.choices:
        for entry in entries:
            if entry not in row.choices:
                return f"{row.name}: {entry!r} is none of {', '.join(row.choices)}"
    return None


def descriptor(row: Row) -> ParameterDescriptor:
    """What ``describe_parameters`` shows."""
    out = ParameterDescriptor(name=row.name, type=_TYPES[row.kind], description=row.text, read_only=not row.changeable)
    if row.unit:
        out.description += f" [{row.unit}]"
    if row.choices:
        out.additional_constraints = "one of " + ", ".join(row.choices)
    if row.span is not None and row.kind == "int":
        out.integer_range = [IntegerRange(from_value=int(row.span[0]), to_value=int(row.span[1]), step=1)]
    elif row.span is not None:
        out.floating_point_range = [FloatingPointRange(from_value=row.span[0], to_value=row.span[1], step=0.0)]
    return out


def declare(node: Node) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """Declare all parameters of the table; return (node settings, mesh name -> mesh settings).

    Raises ParameterError: wrong type, out of range, bad or repeated mesh name, unknown pair.
    """
    settings = {row.name: _declare_one(node, row, row.name) for row in NODE_ROWS}
    names = settings["meshes"]
    for name in names:
        if not _MESH_NAME.fullmatch(name):
            raise ParameterError(
                f"meshes: {name!r} cannot be part of a topic name; use letters, digits and _, a letter first"
            )
    if len(set(names)) != len(names):
        raise ParameterError(f"meshes: names must differ, got {', '.join(names)}")
    ignored_pairs(settings)
    meshes = {
        name: {row.name: _declare_one(node, row, f"mesh.{name}.{row.name}") for row in MESH_ROWS} for name in names
    }
    return settings, meshes


def ignored_pairs(settings: dict[str, Any]) -> list[tuple[str, str]]:
    """Parameter ``ignored_pairs`` as pairs of mesh names. Raises ParameterError."""
    pairs = []
    for text in settings["ignored_pairs"]:
        pair = tuple(text.split(":"))
        if len(pair) != 2 or not set(pair) <= set(settings["meshes"]) or pair[0] == pair[1]:
            raise ParameterError(
                f"ignored_pairs: {text!r} must be NAME:NAME with two different meshes out of "
                f"{', '.join(settings['meshes']) or '(none)'}"
            )
        pairs.append(pair)
    return pairs


def _declare_one(node: Node, row: Row, name: str) -> Any:
    # An empty list has no element type, so rclpy would declare it as a byte array: declare the type instead.
    value = Parameter.Type.STRING_ARRAY if row.kind == "string[]" else row.default
    try:
        node.declare_parameter(name, value, descriptor(row))
        value = node.get_parameter(name).value
    except ParameterUninitializedException:
        return list(row.default)
    except InvalidParameterTypeException as error:
        raise ParameterError(f"{name}: {error}; expected {row.kind}, e.g. {row.default!r}") from error
    except InvalidParameterValueException as error:
        raise ParameterError(f"{name}: {error}; allowed {_allowed(row)}") from error
    value = normalise(row, value)
    if reason := refusal(row, value):
        raise ParameterError(reason.replace(row.name, name, 1))
    return value


def normalise(row: Row, value: Any) -> Any:
    """Plain Python value. YAML and the command line cannot write an empty list of strings: [""] is one."""
    if row.kind == "string[]":
        return [entry for entry in value or [] if entry]
    return list(value) if row.kind == "float[]" else value


def unknown_overrides(node: Node) -> list[str]:
    """Parameters given on the command line or in a file that the node does not have: usually misspelt."""
    given = getattr(node, "_parameter_overrides", {})  # rclpy has no public list of what was given
    return sorted(name for name in given if not node.has_parameter(name) and not name.startswith("qos_overrides."))


def watch(
    node: Node,
    settings: dict[str, Any],
    check: Callable[[dict[str, Any]], str | None],
    on_change: Callable[[], None],
) -> None:
    """Keep ``settings`` up to date with changes at run time; refuse bad ones with a reason.

    check: called with the settings as they would be; returns why they cannot be used, or None.
    on_change: called after each accepted change.
    """

    def on_set(parameters: Iterable[Parameter]) -> SetParametersResult:
        wanted = dict(settings)
        for parameter in parameters:
            row = _BY_NAME.get(parameter.name)
            if row is None:
                continue
            value = normalise(row, parameter.value)
            if reason := refusal(row, value):
                return SetParametersResult(successful=False, reason=reason)
            wanted[row.name] = value
        if reason := check(wanted):
            return SetParametersResult(successful=False, reason=reason)
        settings.update(wanted)
        on_change()
        return SetParametersResult(successful=True)

    node.add_on_set_parameters_callback(on_set)


def _allowed(row: Row) -> str:
    if row.choices:
        return ", ".join(f"`{choice}`" for choice in row.choices)
    if row.span is not None:
        return f"{row.span[0]:,} .. {row.span[1]:,}"
    return ""


def markdown_table() -> str:
    """The README's table of parameters."""
    lines = [
        "| parameter | type | default | allowed | unit | at run time | meaning |",
        "|---|---|---|---|---|---|---|",
    ]
    named = [(row.name, row) for row in NODE_ROWS] + [(f"mesh.NAME.{row.name}", row) for row in MESH_ROWS]
    for name, row in named:
        default = f"`{str(row.default).lower()}`" if row.kind == "bool" else f"`{row.default!r}`".replace("'", '"')
        lines.append(
            f"| `{name}` | {row.kind} | {default} | {_allowed(row)} | {row.unit} | "
            f"{'changeable' if row.changeable else 'read-only'} | {row.text} |"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    print(markdown_table())
