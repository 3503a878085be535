# SPDX-License-Identifier: Apache-2.0
"""An SRDF, MoveIt's file beside a URDF: which pairs of links it takes from the check and which it puts back."""

from collections.abc import Iterable
from dataclasses import dataclass

from hpccd_ros.base.quoting import listed, quoted
from hpccd_ros.robots import xml_tree
from hpccd_ros.robots.errors import RobotError, SemanticsError
from hpccd_ros.robots.xml_tree import Element

DOCUMENT = "SRDF"
Pair = tuple[str, str]


@dataclass(frozen=True)
class Semantics:
    """Pairs of links, in the order of their names. ``enabled``: though a link's default or neighbourhood says else."""

    disabled: frozenset[Pair] = frozenset()
    enabled: frozenset[Pair] = frozenset()
    disabled_links: frozenset[str] = frozenset()  # with all others, but for what is enabled


def parse(text: str, links: Iterable[str]) -> Semantics:
    """links: of the URDF. Raises SemanticsError naming the element: unknown links, no XML, a URDF."""
    try:
        return _semantics(text, set(links))
    except RobotError as error:
        raise SemanticsError(str(error)) from error


def _semantics(text: str, known: set[str]) -> Semantics:
    robot = xml_tree.parse(text, DOCUMENT, "robot")
    for element in robot.all("joint"):
        raise element.error("is of a URDF; name the SRDF beside it, whose pairs are <disable_collisions>")
    return Semantics(
        frozenset(_pair(element, known) for element in robot.all("disable_collisions")),
        frozenset(_pair(element, known) for element in robot.all("enable_collisions")),
        frozenset(_link(element, "link", known) for element in robot.all("disable_default_collisions")),
    )


def _pair(element: Element, known: set[str]) -> Pair:
    a, b = sorted(_link(element, attribute, known) for attribute in ("link1", "link2"))
    return a, b


def _link(element: Element, attribute: str, known: set[str]) -> str:
    name = element.text(attribute)
    if name not in known:
        raise element.error(
            f"names the link {quoted(name)} ({attribute}), and the URDF has none of this name; its links are "
            f"{listed(sorted(known))}"
        )
    return name
