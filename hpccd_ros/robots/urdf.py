# SPDX-License-Identifier: Apache-2.0
"""A URDF as links and joints.

Only ``link``, with its collision or visual geometry, and ``joint`` are read. Other elements (inertia, materials,
transmissions, extensions of simulators and controllers) do not describe shape or motion.
"""

import math
from dataclasses import dataclass

import numpy as np

from hpccd_core.rigid.joints import TURNING, Joint
from hpccd_core.rigid.transform import IDENTITY, Rigid, product
from hpccd_ros.base.quoting import listed, quoted
from hpccd_ros.robots import xml_tree
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.shapes import Box, Capsule, Cylinder, MeshFile, Placed, Sphere
from hpccd_ros.robots.xml_tree import Element

GEOMETRIES = ("collision", "visual")
KINDS = ("revolute", "continuous", "prismatic", "fixed")
LONGEST_NAME = 255
DOCUMENT = "URDF"
MOST_LINKS = 1000  # the detection considers each pair of them in each step


@dataclass(frozen=True)
class Mimic:
    """The value of its joint is ``multiplier`` times that of ``joint``, plus ``offset``."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True, eq=False)
class Link:
    name: str
    geometry: tuple[Placed, ...]


@dataclass(frozen=True, eq=False)
class RobotJoint:
    """``origin``: its frame in that of ``parent``; ``axis`` in its own, of length 1. ``limits``: lower, upper; None
    where the description gives none."""

    name: str
    kind: str
    parent: str
    child: str
    origin: Rigid
    axis: tuple[float, float, float]
    limits: tuple[float, float] | None = None
    mimic: Mimic | None = None

    @property
    def turns(self) -> bool:
        return self.kind in TURNING


@dataclass(frozen=True, eq=False)
class Description:
    """``joints``: each after the one that moves its parent. ``links``: in the order of the text. ``root``: the link
    that no joint moves."""

    name: str
    root: str
    links: tuple[Link, ...]
    joints: tuple[RobotJoint, ...]


def parse(text: str, geometry: str = "collision") -> Description:
    """geometry: which geometry of a link is read, one of GEOMETRIES. Raises RobotError naming the element."""
    if geometry not in GEOMETRIES:
        raise RobotError(f"geometry: {quoted(geometry)} is not known; choose from {', '.join(GEOMETRIES)}")
    robot = xml_tree.parse(text, DOCUMENT, "robot")
    for child in robot.children:
        if child.tag.startswith("xacro:"):
            raise child.error("is a xacro element; expand the file first: xacro FILE > robot.urdf")
    if (count := len(robot.all("link"))) > MOST_LINKS:
        raise robot.error(f"has {count} links; at most {MOST_LINKS} are allowed")
    links: dict[str, Link] = {}
    for element in robot.all("link"):
        name = _name(element)
        if name in links:
            raise element.error("is the second link of this name; give it another one")
        links[name] = Link(name, tuple(_placed(part) for part in element.all(geometry)))
    if not links:
        raise robot.error("has no <link>; give at least one")
    joints: dict[str, RobotJoint] = {}
    moved_by: dict[str, str] = {}  # the joint of each child
    for element in robot.all("joint"):
        joint = _joint(element, links)
        if joint.name in joints:
            raise element.error("is the second joint of this name; give it another one")
        if joint.child in moved_by:
            raise element.error(
                f"has the child {quoted(joint.child)}, which joint {quoted(moved_by[joint.child])} moves already; "
                "links must form a tree"
            )
        joints[joint.name] = joint
        moved_by[joint.child] = joint.name
    _check_mimics(robot, joints)
    root, ordered = _tree(robot, links, joints, moved_by)
    return Description(robot.attributes.get("name", ""), root, tuple(links.values()), ordered)


def _name(element: Element) -> str:
    name = element.text("name")
    if len(name) > LONGEST_NAME or not name.isprintable():
        raise element.error(f"has an invalid name; give one of at most {LONGEST_NAME} printable characters")
    return name


def _joint(element: Element, links: dict[str, Link]) -> RobotJoint:
    name, kind = _name(element), element.text("type")
    if kind in ("floating", "planar"):
        raise element.error(
            f"is {kind}, so no single value moves it; if it only places the robot, remove it, and place the base by TF "
            "or by its pose"
        )
    if kind not in KINDS:
        raise element.error(f"has the type {quoted(kind)}; choose from {', '.join(KINDS)}")
    ends = []
    for tag in ("parent", "child"):
        end = element.needed(tag).text("link")
        if end not in links:
            raise element.error(f"has the {tag} {quoted(end)}, which is not a link; links are {listed(links)}")
        ends.append(end)
    if ends[0] == ends[1]:
        raise element.error("has one link as parent and child; name two")
    return RobotJoint(
        name,
        kind,
        ends[0],
        ends[1],
        _origin(element),
        _axis(element, kind),
        _limits(element, kind),
        _mimic(element, kind),
    )


def _axis(element: Element, kind: str) -> tuple[float, float, float]:
    axis = element.one("axis")
    given = (1.0, 0.0, 0.0) if axis is None or kind == "fixed" else _numbers(axis, "xyz", 3)
    try:
        x, y, z = Joint.of(kind, -1, IDENTITY, given).axis.tolist()
    except ValueError as error:
        raise element.error(f"has an invalid axis: {error}") from error
    return x, y, z


def _limits(element: Element, kind: str) -> tuple[float, float] | None:
    limit = element.one("limit")
    if limit is None or kind not in ("revolute", "prismatic"):
        return None
    lower, upper = (_number(limit, name, 0.0) for name in ("lower", "upper"))
    if lower > upper:
        raise element.error(f"has the lower limit {lower:g} above the upper one {upper:g}; swap them")
    return lower, upper


def _mimic(element: Element, kind: str) -> Mimic | None:
    mimic = element.one("mimic")
    if mimic is None or kind == "fixed":
        return None
    return Mimic(mimic.text("joint"), _number(mimic, "multiplier", 1.0), _number(mimic, "offset", 0.0))


def _check_mimics(robot: Element, joints: dict[str, RobotJoint]) -> None:
    for joint in joints.values():
        passed, at = [joint.name], joint
        while at.mimic is not None:
            followed = joints.get(at.mimic.joint)
            if followed is None or followed.kind == "fixed":
                why = "there is no such joint" if followed is None else "it does not move"
                raise robot.error(f"has the joint {quoted(at.name)}, which mimics {quoted(at.mimic.joint)}: {why}")
            if followed.name in passed:
                raise robot.error(f"has joints that mimic each other in a cycle: {listed([*passed, followed.name])}")
            passed.append(followed.name)
            at = followed


def _tree(
    robot: Element, links: dict[str, Link], joints: dict[str, RobotJoint], moved_by: dict[str, str]
) -> tuple[str, tuple[RobotJoint, ...]]:
    roots = [name for name in links if name not in moved_by]
    if len(roots) != 1:
        what = f"several links that no joint moves ({listed(roots)})" if roots else "a cycle of joints"
        raise robot.error(f"has {what}; links must form one tree")
    of_parent: dict[str, list[RobotJoint]] = {}
    for joint in joints.values():
        of_parent.setdefault(joint.parent, []).append(joint)
    ordered: list[RobotJoint] = []
    waiting = [roots[0]]
    while waiting:
        found = of_parent.get(waiting.pop(0), [])
        ordered += found
        waiting += [joint.child for joint in found]
    if len(ordered) != len(joints):
        lost = sorted(set(joints) - {joint.name for joint in ordered})
        raise robot.error(f"has joints in a cycle: {listed(lost)}; links must form one tree")
    return roots[0], tuple(ordered)


def _placed(element: Element) -> Placed:
    geometry = element.needed("geometry")
    if len(geometry.children) != 1:
        raise geometry.error(f"has {len(geometry.children)} shapes; it needs one: {', '.join(_SHAPES)}")
    (shape,) = geometry.children
    if shape.tag not in _SHAPES:
        raise shape.error(f"is not a known shape; choose from {', '.join(_SHAPES)}")
    return Placed(_SHAPES[shape.tag](shape), _origin(element), element.line)


def _box(element: Element) -> Box:
    x, y, z = _numbers(element, "size", 3)
    if min(x, y, z) < 0.0:
        raise element.error(f"has size {min(x, y, z):g}; lengths must not be negative")
    if (x, y, z).count(0.0) > 1:
        raise element.error(
            f"has size {x:g} {y:g} {z:g}, which leaves no surface; give two lengths above 0, or remove the shape"
        )
    return Box((x, y, z))


def _cylinder(element: Element) -> Cylinder:
    return Cylinder(_size(element, "radius"), _size(element, "length"))


def _sphere(element: Element) -> Sphere:
    return Sphere(_size(element, "radius"))


def _capsule(element: Element) -> Capsule:
    return Capsule(_size(element, "radius"), _size(element, "length"))


def _mesh(element: Element) -> MeshFile:
    uri = element.text("filename").strip()
    if "scale" not in element.attributes:
        return MeshFile(uri)
    x, y, z = _numbers(element, "scale", 3)
    if not x * y * z:
        raise element.error(f"has the scale {x:g} {y:g} {z:g}, which leaves no shape; no factor may be 0")
    return MeshFile(uri, (x, y, z))


_SHAPES = {"box": _box, "cylinder": _cylinder, "sphere": _sphere, "capsule": _capsule, "mesh": _mesh}


def _origin(element: Element) -> Rigid:
    """xyz, and rpy: rotations about the fixed axes x, y, z in this order."""
    origin = element.one("origin")
    if origin is None:
        return IDENTITY
    shift = _numbers(origin, "xyz", 3, (0.0, 0.0, 0.0))
    quaternion = IDENTITY.quaternion
    for number, angle in enumerate(_numbers(origin, "rpy", 3, (0.0, 0.0, 0.0))):
        if angle:
            turn = np.zeros(4)
            turn[number], turn[3] = math.sin(angle / 2), math.cos(angle / 2)
            quaternion = product(turn, quaternion)
    return Rigid.of(shift, quaternion.tolist())


def _numbers(
    element: Element, attribute: str, count: int, default: tuple[float, ...] | None = None
) -> tuple[float, ...]:
    text = element.attributes.get(attribute)
    if text is None and default is not None:
        return default
    needed = "a finite number" if count == 1 else f"{count} finite numbers with spaces between"
    if not (text or "").strip():
        raise element.error(f"has no {attribute}; add the attribute with {needed}")
    try:
        found = tuple(float(word) for word in element.text(attribute).split())
    except ValueError:
        found = ()
    if len(found) != count or not all(math.isfinite(number) for number in found):
        raise element.error(f"has {attribute}={quoted(text or '')}; it must be {needed}")
    return found


def _number(element: Element, attribute: str, default: float) -> float:
    return _numbers(element, attribute, 1, (default,))[0]


def _size(element: Element, attribute: str) -> float:
    (size,) = _numbers(element, attribute, 1)
    if size <= 0.0:
        raise element.error(f"has {attribute} {size:g}; give a length above 0, or remove the shape")
    return size
