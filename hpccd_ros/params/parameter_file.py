# SPDX-License-Identifier: Apache-2.0
"""Read a ROS parameter file, as a node is given one with --params-file."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import listed, printable, shortened
from hpccd_ros.base.yaml_text import loaded

# Characters: far above any that a person writes, far below a recording named by mistake.
MOST = 1_000_000
_PARAMETERS = "ros__parameters"
# UnicodeDecodeError and "no file" of `_text` are ValueErrors.
_UNREADABLE = (yaml.YAMLError, ValueError)


def read_parameters(path) -> dict[str, Any]:
    """{full name: value}, all nodes in the file taken together. Raises UserError that names `path`."""
    try:
        tree = _tree(_text(Path(path)))
    except OSError as error:
        raise UserError(f"--params {path}: cannot be read: {error.strerror}") from error
    except _UNREADABLE as error:
        raise UserError(f"--params {path}: cannot be read: {' '.join(str(error).split())}") from error
    sections = tree.values() if isinstance(tree, dict) else ()
    found = [section.get(_PARAMETERS) if isinstance(section, dict) else None for section in sections]
    if not found or not all(isinstance(parameters, dict) for parameters in found):
        raise UserError(
            f"--params {path}: not a ROS parameter file; write node name or /**, ros__parameters, names and values"
        )
    flat: dict[str, Any] = {}
    for parameters in found:
        flat |= _flat("", parameters)
    for name, value in flat.items():
        if value is None:
            raise UserError(printable(f"--params {path}: {name} has no value"))
    return flat


def without_section(path, node: str) -> str:
    """The warning about a parameter file whose sections are all for other nodes, so that ROS ignores it; "": one is
    for the node of this full name, or the file has none."""
    try:
        sections = list(_sections("", _tree(_text(Path(path)))))
    except (OSError, *_UNREADABLE):
        return ""  # ROS reports it
    if not sections or any(_matches(section, node) for section in sections):
        return ""
    return printable(
        f"parameter file {shortened(path)}: has no section for this node and so no effect on it; name a section "
        f"{node} or /**, not {listed(sections)}"
    )


def value(text: str) -> Any:
    """What a parameter is given by ``text``, as ROS reads it: YAML, or the text itself where that has no such value."""
    try:
        found = _tree(text)
    except yaml.YAMLError:
        return text
    entries = found if isinstance(found, list) else [found]
    if not all(isinstance(entry, (bool, int, float, str)) for entry in entries):
        return text
    if not entries:
        return [""]  # an empty list has no type in ROS
    kinds = {type(entry) for entry in entries}
    beyond = any(type(entry) is int and not -(2**63) <= entry < 2**63 for entry in entries)
    if kinds == {int, float} or (beyond and kinds == {int}):
        try:
            numbers = [float(entry) for entry in entries]
        except OverflowError:
            return text
        return numbers if isinstance(found, list) else numbers[0]
    return found if len(kinds) == 1 else text


def parameter_value(text: str) -> Any:
    """The value that ROS reads from `text` on a command line: YAML, or the text itself if it is none."""
    try:
        return _tree(text)
    except yaml.YAMLError:
        return text


def _text(path: Path) -> str:
    if path.exists() and not path.is_file():
        raise ValueError("no file")
    with open(path, encoding="utf-8") as stream:
        text = stream.read(MOST + 1)
    if len(text) > MOST:
        raise ValueError(f"more than {MOST:,} characters")
    return text


def _sections(namespace: str, tree: Any) -> Iterator[str]:
    """The full names of nodes, or patterns of them, that have parameters in a file."""
    for key, branch in tree.items() if isinstance(tree, dict) else ():
        name = f"{namespace}/{str(key).strip('/')}"
        if isinstance(branch, dict) and _PARAMETERS in branch:
            yield name
        else:
            yield from _sections(name, branch)


def _matches(section: str, node: str) -> bool:
    """Whether ROS takes the section for this node: * is one part of a name, ** any number of them."""
    parts = {"/**": "(/[^/]+)*", "/*": "/[^/]+"}
    pattern = re.sub(r"/[^/]*", lambda part: parts.get(part[0], re.escape(part[0])), section)
    return re.fullmatch(pattern, node) is not None


def _flat(prefix: str, branch: dict) -> dict[str, Any]:
    found = {}
    for key, value in branch.items():
        found |= _flat(f"{prefix}{key}.", value) if isinstance(value, dict) else {f"{prefix}{key}": value}
    return found


def _tree(text: str) -> Any:
    return loaded(text, _Loader)


class _Loader(yaml.SafeLoader):
    """What ROS takes: numbers like 1e-3, no aliases, by which a few lines can stand for more than memory holds."""

    def compose_node(self, parent, index):
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark
            raise yaml.composer.ComposerError(None, None, "ROS parameter files have no aliases", mark)
        return super().compose_node(parent, index)


_NUMBER = re.compile(r"[-+]?[0-9]+[eE][-+]?[0-9]+$")
_Loader.add_implicit_resolver("tag:yaml.org,2002:float", _NUMBER, list("-+0123456789"))
