# SPDX-License-Identifier: Apache-2.0
"""An arm to try and to test with: seven joints that turn, a gripper of two fingers, and a motion of it.

It stands at the origin beside a table whose top is the plane z = 0. In six seconds its gripper comes down on a cloth
near its edge, closes, raises what it holds a little, drags the cloth across the table, opens and lifts. Metres,
radians, seconds; z points up. The elbow swings aside on the way, so that all seven joints turn. At all joints 0 the arm
stands upright.
"""

import math

import numpy as np

from hpccd_core.rigid.transform import IDENTITY, Rigid, product, rotated

NAME = "arm"
JOINTS = tuple(f"joint_{k}" for k in range(1, 8))
FINGER = "finger_left"  # that on the right mimics it
DURATION = 6.0

#: The table's top: x from, to; y from, to; at z = 0.
TABLE = (0.30, 0.90, -0.50, 0.50)
#: Where the fingers close and open (x, y), and how far their tips are above the table then.
GRASP, RELEASE, CLEARANCE = (0.60, -0.15), (0.55, 0.25), 0.001
#: How far their tips are raised above that while they drag.
RAISED = 0.04
#: When they begin to close, are closed, begin to open, are open.
CLOSING, OPENING = (1.5, 2.0), (5.0, 5.5)
#: Of each finger's box: across the way they close, along it, down; its upper end is this far above its tip.
FINGER_SIZE = (0.02, 0.012, 0.06)
#: Of each finger from the middle, when open and when closed.
OPEN, CLOSED = 0.04, 0.002

_SHOULDER = 0.34  # above the table
_UPPER = _FORE = 0.40
_HAND, _FINGERS = 0.13, 0.06  # from the wrist, from the hand
_TOOL = _HAND + _FINGERS + FINGER_SIZE[2]
_FLANGE = 0.08

# Each link: the joint's distance from the one before, its axis, limit, and shapes: kind, sizes, centre's z.
_LINKS: tuple = (
    (0.15, "z", 2.97, (("cylinder", (0.065, 0.12), 0.08), ("sphere", (0.07,), 0.19))),
    (0.19, "y", 2.09, (("cylinder", (0.06, 0.12), 0.13),)),
    (0.20, "z", 2.97, (("cylinder", (0.055, 0.12), 0.07), ("sphere", (0.06,), 0.20))),
    (0.20, "y", 2.36, (("cylinder", (0.05, 0.12), 0.13),)),
    (0.20, "z", 2.97, (("box", (0.085, 0.085, 0.11), 0.065), ("sphere", (0.05,), 0.20))),
    (0.20, "y", 2.09, (("cylinder", (0.04, 0.04), 0.05),)),
    (0.08, "z", 3.05, (("cylinder", (0.035, 0.03), 0.02),)),
)
_BASE = (("box", (0.24, 0.24, 0.03), 0.015), ("cylinder", (0.08, 0.12), 0.09))
_PALM = (("box", (0.05, 0.12, 0.05), 0.03),)
# The visual geometry alone has a cylinder of this radius from each joint to the next, so that the links meet.
_CORES = (0.065, 0.055, 0.05, 0.045, 0.042, 0.036, 0.034, 0.03)


def description(name: str = NAME) -> str:
    """Its URDF. The visual geometry is that of collisions, and between its shapes no gaps."""
    distances = [distance for distance, *_ in _LINKS] + [_HAND - _FLANGE]
    cores = [("cylinder", (radius, length), length / 2) for radius, length in zip(_CORES, distances, strict=True)]
    parts = [_link("base", _BASE, cores[0])]
    for number, (distance, axis, limit, shapes) in enumerate(_LINKS, 1):
        parent = f"link_{number - 1}" if number > 1 else "base"
        limits = f'<limit lower="{-limit}" upper="{limit}" effort="100" velocity="2"/>'
        parts.append(_link(f"link_{number}", shapes, cores[number]))
        parts.append(_joint(f"joint_{number}", "revolute", parent, f"link_{number}", distance, axis, limits))
    parts.append(_link("hand", _PALM, ("box", (0.03, 0.09, _FINGERS), _FINGERS / 2)))
    parts.append(_joint("hand", "fixed", "link_7", "hand", _HAND - _FLANGE))
    for side, sign in (("left", 1), ("right", -1)):
        limits = f'<limit lower="0" upper="{OPEN}" effort="20" velocity="0.2"/>'
        mimic = f'<mimic joint="{FINGER}" multiplier="1" offset="0"/>' if side == "right" else ""
        # At 0 the inner faces are in the middle.
        finger = ("box", FINGER_SIZE, FINGER_SIZE[2] / 2, sign * FINGER_SIZE[1] / 2)
        parts.append(_link(f"finger_{side}", (finger,)))
        axis = "y" if sign > 0 else "-y"
        parts.append(_joint(f"finger_{side}", "prismatic", "hand", f"finger_{side}", _FINGERS, axis, limits + mimic))
    return "\n".join(['<?xml version="1.0"?>', f'<robot name="{name}">', *parts, "</robot>", ""])


def joint_positions(t: float) -> dict[str, float]:
    """Of all joints, also the one that mimics, t seconds after the beginning; at rest before and after the motion."""
    t = min(max(t, 0.0), DURATION)
    place, yaw = tip(t)
    swivel = 0.2 * (1.0 - math.cos(2.0 * math.pi * t / DURATION))
    turns = _turns(place, yaw, swivel)
    return dict(zip(JOINTS, turns, strict=True)) | {FINGER: finger(t), "finger_right": finger(t)}


def finger(t: float) -> float:
    """How far the inner face of each finger is from the middle."""
    return OPEN + (CLOSED - OPEN) * (_smooth(t, *CLOSING) - _smooth(t, *OPENING))


def tip(t: float) -> tuple[np.ndarray, float]:
    """Where the point between the fingers' ends is, (3,), and how far the gripper is turned about the vertical.

    Sums, products and quotients alone: the same bits on any machine, as in `finger`.
    """
    (closing, closed), (opening, opened) = CLOSING, OPENING
    down, drag, lift = _smooth(t, 0.0, closing), _smooth(t, closed, opening), _smooth(t, opened, DURATION)
    raised = RAISED * (_smooth(t, closed, closed + 0.8) - _smooth(t, opening - 0.8, opening))
    x = GRASP[0] - 0.08 * (1.0 - down) + (RELEASE[0] - GRASP[0]) * drag
    y = GRASP[1] - 0.10 * (1.0 - down) + (RELEASE[1] - GRASP[1]) * drag
    z = CLEARANCE + 0.20 * (1.0 - down) + raised + 0.12 * lift
    return np.array([x, y, z]), 0.6 * drag - 0.3


def _smooth(t: float, start: float, end: float) -> float:
    """From 0 to 1, with speed and acceleration 0 at both ends."""
    s = min(max((t - start) / (end - start), 0.0), 1.0)
    return s * s * s * (10.0 + s * (6.0 * s - 15.0))


def _turns(place: np.ndarray, yaw: float, swivel: float) -> list[float]:
    """Values of the seven joints that bring the tip to ``place`` with the gripper down. swivel: of the elbow, about the
    line from the shoulder to the wrist."""
    gripper = product(_about("z", yaw), _about("y", math.pi))
    way = place - rotated(Rigid(gripper, np.zeros(3)).rotation(), np.array([0.0, 0.0, _TOOL]))
    x, y, z = (way - [0.0, 0.0, _SHOULDER]).tolist()
    far = math.sqrt(x * x + y * y + z * z)
    elbow = math.acos((far * far - _UPPER * _UPPER - _FORE * _FORE) / (2.0 * _UPPER * _FORE))
    # How far the wrist is off the upper arm, seen from the shoulder.
    off = math.atan2(_FORE * math.sin(elbow), _UPPER + _FORE * math.cos(elbow))
    shoulder = product(_about("z", math.atan2(y, x)), _about("y", math.acos(z / far) - off))
    aside = np.array([x, y, z]) / far * math.sin(swivel / 2)
    shoulder = product(np.append(aside, math.cos(swivel / 2)), shoulder)
    arm = product(shoulder, _about("y", elbow))
    wrist = product(arm * [-1, -1, -1, 1], gripper)
    return [*_zyz(shoulder), elbow, *_zyz(wrist)]


def _zyz(quaternion: np.ndarray) -> tuple[float, float, float]:
    """Turns about z, y, z, of which the one about y is from 0 to pi."""
    m = Rigid(quaternion, np.zeros(3)).rotation().tolist()
    middle = math.acos(min(max(m[2][2], -1.0), 1.0))
    return math.atan2(m[1][2], m[0][2]), middle, math.atan2(m[2][1], -m[2][0])


def _about(axis: str, angle: float) -> np.ndarray:
    turn = np.array(IDENTITY.quaternion)
    turn["xyz".index(axis)], turn[3] = math.sin(angle / 2), math.cos(angle / 2)
    return turn


def _link(name: str, shapes: tuple, *visual_only: tuple) -> str:
    lines = [f'  <link name="{name}">']
    for use in ("visual", "collision"):
        for kind, sizes, z, *y in (*shapes, *visual_only) if use == "visual" else shapes:
            size = {"box": 'size="{} {} {}"', "cylinder": 'radius="{}" length="{}"', "sphere": 'radius="{}"'}[
                kind
            ].format(*sizes)
            origin = f'<origin xyz="0 {y[0] if y else 0} {z}" rpy="0 0 0"/>'
            lines.append(f"    <{use}>{origin}<geometry><{kind} {size}/></geometry></{use}>")
    return "\n".join([*lines, "  </link>"])


def _joint(name: str, kind: str, parent: str, child: str, distance: float, axis: str = "", more: str = "") -> str:
    sign = -1 if axis.startswith("-") else 1
    direction = " ".join(str(sign if letter == axis[-1] else 0) for letter in "xyz") if axis else ""
    along = f'<axis xyz="{direction}"/>' if axis else ""
    return (
        f'  <joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0 0 {round(distance, 6)}" rpy="0 0 0"/>{along}{more}</joint>'
    )
