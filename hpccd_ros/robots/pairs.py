# SPDX-License-Identifier: Apache-2.0
"""Which pairs of links are never tested against each other.

Links joined by fixed joints are one body. Links of one body, and of two bodies that a joint joins, touch where they are
joined. Others are tested, also those that meet across a link without geometry: an SRDF says of these what may touch.
"""

from itertools import combinations, product

from hpccd_ros.robots.srdf import Pair, Semantics
from hpccd_ros.robots.urdf import Description


def ignored(description: Description, semantics: Semantics | None = None) -> frozenset[Pair]:
    """Pairs of names of links, in the order of their names. What the SRDF disables beats what it enables."""
    semantics = semantics or Semantics()
    by_default = _near(description) | _of_links(description, semantics.disabled_links)
    return (by_default - semantics.enabled) | {pair for pair in semantics.disabled if pair[0] != pair[1]}


def _near(description: Description) -> frozenset[Pair]:
    body = {link.name: link.name for link in description.links}  # of each link: the first of its body
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
