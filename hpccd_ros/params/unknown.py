# SPDX-License-Identifier: Apache-2.0
"""Parameters that a node does not have: misspelt ones are rejected, those of other nodes are only warned of.

A misspelt `stop_distance` would start a node without the topic stop. A parameter file for several nodes, with the
section /**, gives each node the parameters of all.
"""

from collections.abc import Iterable, Sequence
from typing import Any

from hpccd_ros.base.quoting import counted, listed, nearest, shortened, suggestion
from hpccd_ros.params.table import (
    MESH_ROWS,
    NODE_ROWS,
    PAIRS,
    PLANE,
    PLANE_ROWS,
    ROBOT,
    ROBOT_ROWS,
    STOP_ROWS,
    Row,
)
from hpccd_ros.params.values import ParameterError

MESH = "mesh"
# First part of a name -> the parameter with the names of its sections, and the rows of each.
_SECTIONS: dict[str, tuple[str, Sequence[Row]]] = {
    MESH: ("meshes", MESH_ROWS),
    ROBOT: ("robots", ROBOT_ROWS),
    PLANE: ("planes", PLANE_ROWS),
}
_QOS = "qos_overrides"  # of a topic that the node does not have: without effect
_FIRST_PARTS = (*_SECTIONS, PAIRS, _QOS)
_NAMES = [row.name for row in NODE_ROWS]
# Parameters of the node whose entries are NAME:VALUE.
_OF_MOVING = ("thickness", "stop_detail")
# Parameters of a mesh that no other node is likely to have.
_OF_MESHES = ("ignored_rings", "ignored_at_rest")
# Whatever begins so is taken for a parameter of the topic stop.
_STOP = "stop"
# From this similarity on (difflib, 0 .. 1) a name is taken for a misspelt one of ours: 0.92 for stop_distanse and
# stop_distance, 0.63 for update_rate and max_rate.
_NEAR = 0.8
# Problems that are reported at once.
_MOST = 3
_FOREIGN = "a parameter of another node belongs under that node's name in the parameter file, not under /**"


def check(unknown: Iterable[str], settings: dict[str, Any]) -> list[str]:
    """The names among ``unknown``, which a node of these settings does not have, that belong to other nodes.

    Raises ParameterError for names that resemble ours or lie in our sections.
    """
    foreign, problems = [], []
    for name in sorted(unknown):
        if why := _problem(name, settings):
            problems.append(why)
        else:
            foreign.append(name)
    if problems:
        more = f"; {counted(len(problems) - _MOST, 'more unknown name')}" if len(problems) > _MOST else ""
        raise ParameterError(f"{'; '.join(problems[:_MOST])}{more}")
    return foreign


def warning(name: str) -> str:
    """About a name that `check` returned."""
    return f"parameter {shortened(name)} is unknown and has no effect; docs/parameters.md lists all"


def _problem(name: str, settings: dict[str, Any]) -> str:
    """Why ``name`` is rejected, and the remedy; "": it belongs to another node."""
    first, dot, rest = name.partition(".")
    shown = shortened(name)
    if first in _SECTIONS:
        return f"{shown}: {_in_section(first, rest, settings)}"
    if first in _NAMES:
        return f"{shown}: {first} is a parameter, not a section of others; {_instead(first, rest)}"
    if first == _QOS:
        return ""
    if dot:
        near = nearest(first.lower(), _FIRST_PARTS, _NEAR)
        return f"{shown}: no such parameter; did you mean {shortened(f'{near}.{rest}')}?" if near else ""
    if near := suggestion(first.lower(), _NAMES, _NEAR):
        return f"{shown}: no such parameter; {_FOREIGN}{near}"
    if first in _OF_MESHES:
        return f"{shown}: no such parameter of the node; write {MESH}.NAME.{first}"
    if first.lower().startswith(_STOP):
        return (
            f"{shown}: no such parameter; those of the topics stop and speed_scale are "
            f"{listed(r.name for r in STOP_ROWS)}; {_FOREIGN}"
        )
    return ""


def _in_section(first: str, rest: str, settings: dict[str, Any]) -> str:
    parameter, rows = _SECTIONS[first]
    names, keys = settings[parameter], [row.name for row in rows]
    owner, _, key = rest.partition(".")
    if not key:
        meant = "" if rest else f"; did you mean {parameter}?"
        return f"no parameter; write {first}.NAME.KEY, with a KEY out of {', '.join(keys)}{meant}"
    if owner not in names:
        near = nearest(owner, names)
        meant = f"; did you mean {first}.{near}.{shortened(key)}?" if near else ""
        return (
            f"{shortened(owner)} is not in the parameter {parameter} ({listed(names) or 'which is empty'}); add it "
            f"there, or leave out {first}.{shortened(owner)}.*{meant}"
        )
    if key in _OF_MOVING and first != PLANE:
        return f'no such parameter of a {first}; write {key}: ["{shortened(owner)}:VALUE"]'
    near = suggestion(key, keys)
    return f"no such parameter of a {first}; there are {', '.join(keys)}" + near


def _instead(first: str, rest: str) -> str:
    by_list = {parameter: section for section, (parameter, _) in _SECTIONS.items()}
    if first in by_list:
        return f"did you mean {by_list[first]}.{shortened(rest)}?"
    return f"give {first} itself a value"
