# SPDX-License-Identifier: Apache-2.0
"""An SRDF, MoveIt's file for a URDF: which pairs of links are disabled and which are enabled again; and the resulting
pairs that are not tested against each other.

Links joined by fixed joints are one body. Links of one body, and of two bodies joined by a joint, touch at the joint
and are not tested. All others are tested, also those joined by a link without geometry: an SRDF disables them.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations, product

from hpccd_ros.base.quoting import listed, quoted
from hpccd_ros.robots import xml_tree
from hpccd_ros.robots.errors import RobotError, SemanticsError
from hpccd_ros.robots.urdf import Description
from hpccd_ros.robots.xml_tree import Element

DOCUMENT = "SRDF"
Pair = tuple[str, str]


@dataclass(frozen=True)
class Semantics:
    """Pairs of links, in the order of their names. ``enabled``: even if a default or the tree ignores them.
    ``ignored``: a sentence about entries without effect; "": there are none."""

    disabled: frozenset[Pair] = frozenset()
    enabled: frozenset[Pair] = frozenset()
    disabled_links: frozenset[str] = frozenset()  # with all others, except enabled pairs
    ignored: str = ""


def parse(text: str, links: Iterable[str]) -> Semantics:
    """links: of the URDF; entries that name others are ignored, as in MoveIt. Raises SemanticsError naming the element
    if it is not XML, is a URDF, or has an entry without a name."""
    try:
        return _semantics(text, set(links))
    except RobotError as error:
        raise SemanticsError(str(error)) from error


def _semantics(text: str, known: set[str]) -> Semantics:
    robot = xml_tree.parse(text, DOCUMENT, "robot")
    for element in robot.all("joint"):
        raise element.error("belongs to a URDF; name the SRDF, which has <disable_collisions>")
    unknown: list[str] = []

    def pairs(tag: str) -> frozenset[Pair]:
        found = _entries(robot.all(tag), ("link1", "link2"), known, unknown)
        return frozenset((min(pair), max(pair)) for pair in found)

    disabled, enabled = pairs("disable_collisions"), pairs("enable_collisions")
    by_default = _entries(robot.all("disable_default_collisions"), ("link",), known, unknown)
    ignored = (
        f"{DOCUMENT}: entries about links that are not in the URDF are ignored: {listed(unknown)}; check that "
        "it is the SRDF of this robot"
    )
    return Semantics(disabled, enabled, frozenset(link for (link,) in by_default), ignored if unknown else "")


def _entries(
    elements: Iterable[Element], attributes: tuple[str, ...], known: set[str], unknown: list[str]
) -> list[tuple[str, ...]]:
    """The names of links in each element. Elements with a link that is not ``known`` go to ``unknown`` instead."""
    found = []
    for element in elements:
        names = tuple(element.text(attribute) for attribute in attributes)
        lacking = [name for name in names if name not in known]
        if lacking:
            unknown.append(f"<{element.tag}> in line {element.line} names {quoted(lacking[0])}")
        else:
            found.append(names)
    return found


def ignored(description: Description, semantics: Semantics | None = None) -> frozenset[Pair]:
    """Pairs of names of links, in the order of their names. Pairs that the SRDF disables by name have priority over
    enabled ones."""
    semantics = semantics or Semantics()
    by_default = _near(description) | _of_links(description, semantics.disabled_links)
    return (by_default - semantics.enabled) | {pair for pair in semantics.disabled if pair[0] != pair[1]}


def _near(description: Description) -> frozenset[Pair]:
    body = {link.name: link.name for link in description.links}  # for each link: the first link of its body
    for joint in description.joints:  # from the root on
        if joint.kind == "fixed":
            body[joint.child] = body[joint.parent]
    links_of: dict[str, list[str]] = {}
    for link in sorted(body):
        links_of.setdefault(body[link], []).append(link)
    # Lists only ignored pairs, not the pairs of all links.
    near = {pair for links in links_of.values() for pair in combinations(links, 2)}
    for joint in description.joints:
        if (ends := (body[joint.parent], body[joint.child])) and ends[0] != ends[1]:
            near.update((min(pair), max(pair)) for pair in product(links_of[ends[0]], links_of[ends[1]]))
    return frozenset(near)


def _of_links(description: Description, links: frozenset[str]) -> frozenset[Pair]:
    names = [link.name for link in description.links]
    return frozenset((min(a, b), max(a, b)) for a in links for b in names if a != b)
