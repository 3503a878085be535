# SPDX-License-Identifier: Apache-2.0
"""Random robots as URDF, and forward kinematics by matrices that share no code with the package."""

import math
import xml.etree.ElementTree as ElementTree

import numpy as np

KINDS = ("revolute", "continuous", "prismatic", "fixed")


def words(numbers):
    return " ".join(repr(float(number)) for number in numbers)


def random_urdf(rng, links=8, mimics=True, shapes=False):
    """A random tree; joints are written in any order. Names tell nothing of it."""
    names = [f"l{k}" for k in rng.permutation(links)]
    parts, joints, movable = [], [], []
    for number, name in enumerate(names):
        shape = '<collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision>' if shapes else ""
        parts.append(f'<link name="{name}">{shape}</link>')
        if not number:
            continue
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)  # yourdfpy takes the slide of a longer one for longer
        parent, kind = names[rng.integers(number)], KINDS[rng.integers(4)]
        origin = f'<origin xyz="{words(rng.normal(size=3))}" rpy="{words(rng.uniform(-4, 4, 3))}"/>'
        mimic = ""
        if mimics and movable and kind != "fixed" and rng.random() < 0.4:
            mimic = f'<mimic joint="{movable[rng.integers(len(movable))]}" multiplier="-1.5" offset="0.25"/>'
        elif kind != "fixed":
            movable.append(f"j{number}")
        joints.append(
            f'<joint name="j{number}" type="{kind}"><parent link="{parent}"/><child link="{name}"/>{origin}'
            f'<axis xyz="{words(axis)}"/><limit lower="-9" upper="9" effort="1" velocity="1"/>{mimic}</joint>'
        )
    parts += [joints[k] for k in rng.permutation(len(joints))]
    return f'<robot name="random">{"".join(parts)}</robot>', movable


def matrices(urdf, positions):
    """4 x 4 of each link, by Rodrigues' formula and products of matrices."""
    joints = {j.find("child").get("link"): j for j in ElementTree.fromstring(urdf).iter("joint")}
    links = [link.get("name") for link in ElementTree.fromstring(urdf).iter("link")]

    def value(joint):
        mimic = joint.find("mimic")
        if mimic is None:
            return positions.get(joint.get("name"), 0.0)
        followed = next(j for j in joints.values() if j.get("name") == mimic.get("joint"))
        return float(mimic.get("multiplier")) * value(followed) + float(mimic.get("offset"))

    def pose(link):
        if link not in joints:
            return np.eye(4)
        joint = joints[link]
        origin, axis = np.eye(4), np.array(joint.find("axis").get("xyz").split(), float)
        r, p, y = (float(word) for word in joint.find("origin").get("rpy").split())
        origin[:3, :3] = turn([0, 0, 1], y) @ turn([0, 1, 0], p) @ turn([1, 0, 0], r)
        origin[:3, 3] = np.array(joint.find("origin").get("xyz").split(), float)
        axis, moved = axis / np.linalg.norm(axis), np.eye(4)
        if joint.get("type") in ("revolute", "continuous"):
            moved[:3, :3] = turn(axis, value(joint))
        elif joint.get("type") == "prismatic":
            moved[:3, 3] = axis * value(joint)
        return pose(joint.find("parent").get("link")) @ origin @ moved

    return {link: pose(link) for link in links}


def turn(axis, angle):
    x, y, z = axis
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], float)
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k
