# SPDX-License-Identifier: Apache-2.0
"""Checks of parameter values against the table, whether they come from a node or a file."""

from collections.abc import Iterable
from typing import Any

from hpccd_ros.base import quoting
from hpccd_ros.middleware import topic_names
from hpccd_ros.params.table import (
    MESH_ROWS,
    NODE_ROWS,
    PAIR_ROWS,
    PAIRS,
    PLANE,
    PLANE_ROWS,
    ROBOT,
    ROBOT_ROWS,
    Row,
)


class ParameterError(ValueError):
    """An invalid parameter; the text names it and the remedy, in one printable line: names in it may be any."""

    def __init__(self, text: str) -> None:
        super().__init__(quoting.printable(text))


def unusable_value(row: Row, value: Any) -> str | None:
    """Why ``value`` (of the right type; None: not set) cannot be used, or None."""
    if value is None:
        return None if row.default is None else f"{row.name}: has no value; {expected(row)}"
    if row.span is not None and not row.span[0] <= value <= row.span[1]:
        return f"{row.name}: {value} is outside {row.span[0]} .. {row.span[1]}"
    if row.least is not None and row.span[0] < value < row.least:
        return f"{row.name}: {value} is not valid; use {row.span[0]:g}, or at least {row.least:g}"
    entries = value if row.kind == "string[]" else [value]
    if row.choices:
        for entry in entries:
            if entry not in row.choices and entry != row.default:
                return f"{row.name}: {quoting.not_one_of(entry, row.choices)}"
    return None


def usable(row: Row, name: str, value: Any) -> Any:
    """The value of the parameter with this full name as `normalise` gives it. Raises ParameterError."""
    value = normalise(row, value)
    if reason := unusable_value(row, value):
        raise ParameterError(reason.replace(row.name, name, 1))
    return value


def normalise(row: Row, value: Any) -> Any:
    """Plain Python value. YAML and the command line cannot write an empty list of strings: [""] is one."""
    if row.kind == "string[]":
        return [entry for entry in value or [] if entry]
    if value is None:
        return None
    if row.kind == "float[]":
        return [float(entry) for entry in value]
    return float(value) if row.kind == "float" else value


def expected(row: Row) -> str:
    """The type, with an example."""
    return f"expected {row.kind}" + (f", e.g. {text}" if (text := example(row)) else "")


def example(row: Row) -> str:
    """A value in YAML, with its unit; "": a text of any kind."""
    value = row.default if row.example is None else row.example
    text = str(value).lower() if row.kind == "bool" else repr(value)
    return "" if value in (None, "") else f"{text} ({row.unit})" if row.unit else text


def row_of(name: str) -> Row | None:
    """The row of the parameter with this full name."""
    section, _, _ = name.partition(".")
    rows = {"mesh": MESH_ROWS, ROBOT: ROBOT_ROWS, PLANE: PLANE_ROWS, PAIRS: PAIR_ROWS}.get(section, NODE_ROWS)
    key = name if rows is NODE_ROWS else name.rpartition(".")[2]
    return next((row for row in rows if row.name == key), None)


def allowed(row: Row) -> str:
    """The allowed values in Markdown; empty: any of the type."""
    if row.choices:
        return ", ".join(f"`{choice}`" for choice in row.choices)
    if row.least is not None:
        return f"{row.span[0]:g}, {row.least:g} .. {row.span[1]:,}"
    if row.span is not None:
        return f"{row.span[0]:,} .. {row.span[1]:,}"
    return ""


def checked(given: dict[str, Any]) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """(node settings, mesh name -> mesh settings) of the parameters ``given`` by full name, as a file has them.

    settings["pairs"]: name of a pair -> its settings; settings["robot"], settings["plane"]: name of a robot or plane ->
    its settings. None: not set. Raises ParameterError: wrong type, out of range, bad or repeated name of a mesh, robot
    or plane, unknown parameter of a pair.
    """
    settings = {row.name: _checked_value(row, row.name, given.get(row.name)) for row in NODE_ROWS}
    check_names(settings)
    settings[ROBOT] = {
        robot: {row.name: _checked_value(row, name, given.get(name)) for row, name in robot_rows(robot)}
        for robot in settings["robots"]
    }
    settings[PLANE] = {
        plane: {row.name: _checked_value(row, name, given.get(name)) for row, name in plane_rows(plane)}
        for plane in settings["planes"]
    }
    settings[PAIRS] = {
        pair: {row.name: _checked_value(row, name, given.get(name)) for row, name in pair_rows(pair)}
        for pair in pair_names(given)
    }
    of_mesh = {mesh: f"mesh.{mesh}." for mesh in settings["meshes"]}
    meshes = {
        mesh: {row.name: _checked_value(row, prefix + row.name, given.get(prefix + row.name)) for row in MESH_ROWS}
        for mesh, prefix in of_mesh.items()
    }
    return settings, meshes


_PLAIN = {"bool": (bool,), "int": (int,), "float": (float, int), "string": (str,)}


def _checked_value(row: Row, name: str, value: Any) -> Any:
    if value is None:
        return normalise(row, row.default)
    is_list = row.kind.endswith("[]") and isinstance(value, list)
    entries, kind = (value, row.kind[:-2]) if is_list else ([value], row.kind)
    # Not isinstance: True is an int. JSON and YAML have integers beyond those of ROS, and beyond any float.
    if not all(type(entry) in _PLAIN.get(kind, ()) for entry in entries) or (
        kind == "float" and not all(type(entry) is float or -(2**63) <= entry < 2**63 for entry in entries)
    ):
        raise ParameterError(f"{name}: {value!r} is of the wrong type; {expected(row)}")
    return usable(row, name, value)


def check_names(settings: dict[str, Any]) -> None:
    """Names of meshes, robots and planes. Raises ParameterError for one that is invalid in a topic, or is repeated."""
    for parameter in ("meshes", "robots", "planes"):
        names = settings[parameter]
        for name in names:
            if not topic_names.MESH_NAME.fullmatch(name):
                raise ParameterError(
                    f"{parameter}: {quoting.quoted(name)} cannot be part of a topic name; use letters, digits and _, a "
                    "letter first"
                )
        if len(set(names)) != len(names):
            raise ParameterError(
                f"{parameter}: names must differ, {quoting.repeated(names)} is listed twice; use each name once"
            )
    for parameter, others in (("robots", ("meshes",)), ("planes", ("meshes", "robots"))):
        for other in others:
            if both := sorted(set(settings[other]) & set(settings[parameter])):
                raise ParameterError(
                    f"{parameter}: {quoting.listed(both)} is also in the parameter {other}; choose another name"
                )


def pair_names(given: Iterable[str]) -> list[str]:
    """Each NAME of parameters pairs.NAME.* among the full names ``given``. Raises ParameterError for an invalid
    one."""
    keys, found = [row.name for row in PAIR_ROWS], set()
    for name in sorted(given):
        first, _, rest = name.partition(".")
        if first != PAIRS:
            continue
        pair, _, key = rest.partition(".")
        if not pair or key not in keys:
            raise ParameterError(
                f"{quoting.shortened(name)}: no parameter of a pair of meshes; there are {PAIRS}.NAME.KEY with a NAME "
                f"without dots and a KEY out of {', '.join(keys)}{quoting.suggestion(key, keys)}"
            )
        found.add(pair)
    return sorted(found)


def pair_rows(pair: str) -> list[tuple[Row, str]]:
    """The parameters of a pair, with their full names."""
    return [(row, f"{PAIRS}.{pair}.{row.name}") for row in PAIR_ROWS]


def robot_rows(robot: str) -> list[tuple[Row, str]]:
    """The parameters of a robot, with their full names."""
    return [(row, f"{ROBOT}.{robot}.{row.name}") for row in ROBOT_ROWS]


def plane_rows(plane: str) -> list[tuple[Row, str]]:
    """The parameters of a plane, with their full names."""
    return [(row, f"{PLANE}.{plane}.{row.name}") for row in PLANE_ROWS]


def undeclared(name: str, known: Iterable[str]) -> str:
    """Why a parameter that a running node does not have cannot be set. known: those that it has."""
    try:
        pairs = pair_names([name])
    except ParameterError as error:
        return str(error)
    if pairs:
        return (
            f"{quoting.shortened(name)}: the node has no pair of this name, and takes such names only when it starts; "
            f"start it with {quoting.shortened(f'{PAIRS}.{pairs[0]}.meshes')}, or name both meshes in pair_separation, "
            "pair_accuracy, pair_features or ignored_pairs"
        )
    near = quoting.suggestion(name, known)
    return f"{quoting.shortened(name)}: the node has no such parameter; docs/parameters.md lists all{near}"


# Parameters of every node.
_ROS_OWN = ("use_sim_time", "start_type_description_service")


def unknown(
    given: Iterable[str], meshes: Iterable[str], robots: Iterable[str] = (), planes: Iterable[str] = ()
) -> list[str]:
    """Those of the names ``given`` that a node of these meshes, robots and planes would not have."""
    rows = {row.name for row in NODE_ROWS} | {f"mesh.{mesh}.{row.name}" for mesh in meshes for row in MESH_ROWS}
    of_pairs = {name for pair in pair_names(given) for _, name in pair_rows(pair)}
    of_robots = {name for robot in robots for _, name in robot_rows(robot)}
    of_planes = {name for plane in planes for _, name in plane_rows(plane)}
    known = rows | of_pairs | of_robots | of_planes | set(_ROS_OWN)
    return sorted(n for n in given if n not in known and not n.startswith("qos_overrides."))
