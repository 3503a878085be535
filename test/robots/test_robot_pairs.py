# SPDX-License-Identifier: Apache-2.0
"""Which links are never tested against each other: neighbours, and what an SRDF says."""

from itertools import combinations

import pytest
from random_urdf import random_urdf

from hpccd_ros.robots import srdf, urdf
from hpccd_ros.robots.errors import RobotError

#        a -revolute- b -fixed- c -prismatic- d -revolute- e;  b -fixed- f
JOINTS = [
    ("revolute", "a", "b"),
    ("fixed", "b", "c"),
    ("prismatic", "c", "d"),
    ("revolute", "d", "e"),
    ("fixed", "b", "f"),
]


def robot():
    links = "".join(f'<link name="{name}"/>' for name in "fedcba")
    joints = "".join(
        f'<joint name="{p}{c}" type="{kind}"><parent link="{p}"/><child link="{c}"/></joint>' for kind, p, c in JOINTS
    )
    return urdf.parse(f'<robot name="r">{links}{joints}</robot>')


def words(found):
    return sorted(a + b for a, b in found)


def semantics(inside):
    return srdf.parse(f'<robot name="r">{inside}</robot>', "abcdef")


def test_neighbours_are_ignored_and_links_that_are_fixed_count_as_one():
    # bodies: a | b c f | d | e
    assert words(srdf.ignored(robot())) == ["ab", "ac", "af", "bc", "bd", "bf", "cd", "cf", "de", "df"]


@pytest.mark.parametrize("seed", range(20))
def test_neighbours_of_random_robots(seed):
    """Against the definition: joined by a path of fixed joints with one other at most."""
    import numpy as np

    description = urdf.parse(random_urdf(np.random.default_rng(seed), links=9)[0])
    near = {}
    for joint in description.joints:
        for a, b in ((joint.parent, joint.child), (joint.child, joint.parent)):
            near.setdefault(a, []).append((b, joint.kind != "fixed"))

    def least(a, b):
        costs, waiting = {a: 0}, [a]
        while waiting:
            at = waiting.pop()
            for to, cost in near.get(at, []):
                if costs[at] + cost < costs.get(to, 99):
                    costs[to] = costs[at] + cost
                    waiting.append(to)
        return costs[b]

    names = sorted(link.name for link in description.links)
    assert srdf.ignored(description) == {(a, b) for a, b in combinations(names, 2) if least(a, b) <= 1}


def test_what_an_srdf_disables_is_added_and_what_it_enables_is_put_back():
    default = set(words(srdf.ignored(robot())))
    disabled = semantics('<disable_collisions link1="e" link2="a" reason="Never"/><group name="g"/>')
    assert set(words(srdf.ignored(robot(), disabled))) == default | {"ae"}
    enabled = semantics('<enable_collisions link1="d" link2="c"/>')
    assert set(words(srdf.ignored(robot(), enabled))) == default - {"cd"}
    of_link = semantics('<disable_default_collisions link="e"/><enable_collisions link1="e" link2="b"/>')
    assert set(words(srdf.ignored(robot(), of_link))) == default | {"ae", "ce", "ef"}
    both = semantics('<enable_collisions link1="a" link2="b"/><disable_collisions link1="a" link2="b"/>')
    assert "ab" in words(srdf.ignored(robot(), both))
    itself = semantics('<disable_collisions link1="a" link2="a"/>')
    assert set(words(srdf.ignored(robot(), itself))) == default


@pytest.mark.parametrize(
    "inside, message",
    [
        ('<disable_collisions link1="a"/>', "<disable_collisions> has no attribute link2; add it"),
        ('<disable_default_collisions link=""/>', "<disable_default_collisions> has no attribute link; add it"),
        ("<", "SRDF: is not XML"),
    ],
)
def test_entries_without_a_name_are_rejected(inside, message):
    with pytest.raises(RobotError, match=message):
        semantics(inside)


def test_entries_that_name_unknown_links_and_joints_are_ignored_with_a_warning():
    found = semantics(
        '<disable_collisions link1="a" link2="x"/>\n<disable_collisions link1="e" link2="a"/>'
        '<enable_collisions link1="y" link2="a"/><disable_default_collisions link="z"/>'
        '<group name="g"><joint name="of another"/><chain base_link="v" tip_link="w"/></group>'
        '<passive_joint name="of another"/><virtual_joint name="v" type="fixed" parent_frame="w" child_link="x"/>'
        '<joint_property joint_name="of another" property_name="p" value="1"/><end_effector name="e" parent_link="x"/>'
    )
    assert found.ignored == (
        "SRDF: entries about links that are not in the URDF are ignored: <disable_collisions> in line 1 names "
        "'x', <enable_collisions> in line 2 names 'y', <disable_default_collisions> in line 2 names 'z'; check that it "
        "is the SRDF of this robot"
    )
    assert (found.disabled, found.enabled, found.disabled_links) == ({("a", "e")}, set(), set())
    assert not semantics('<disable_collisions link1="e" link2="a"/>').ignored
    many = semantics('<disable_collisions link1="a" link2="x"/>' * 5000)
    assert "and 4990 more" in many.ignored and len(many.ignored) < 1000


def test_hostile_xml_is_rejected_here_too():
    with pytest.raises(RobotError, match="SRDF, line 1: has a document type"):
        srdf.parse("<!DOCTYPE r []><robot/>", "ab")
    with pytest.raises(RobotError, match="<srdf> is the outermost element"):
        srdf.parse("<srdf/>", "ab")
    with pytest.raises(RobotError, match="SRDF, line 2: <joint name='j'> belongs to a URDF"):
        srdf.parse('<robot><link name="a"/>\n<joint name="j"/></robot>', "ab")
