# SPDX-License-Identifier: Apache-2.0
"""A knobbly body with limbs is drawn between two turning rollers, which squeeze it flat.

After the armadillo that the literature of incremental potential contact pulls through rollers; its size, not its data.
A closed form, no simulation: the body is posed (limbs fold against it as they come to the rollers), moved down, and
pressed into the space between the rollers. Its skin there lies a hair inside of the rollers, which turn faster than
it moves.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hpccd_core.shapes import icosphere
from hpccd_ros.scenes import shapes
from hpccd_ros.scenes.exactmath import PI, axis_angle, dot, normalized, random_stream, rotate, sincos
from hpccd_ros.scenes.scene import Frame, Mesh, Scene

FRAME_PERIOD = 1 / 60
ROLLER, CORE, HALF_WIDTH = 0.3, 0.2, 0.6  # of a roller: radius, radius of its bore, half of its length
HALF_GAP = 0.07  # between the rollers, at the nip
PRESSED = 1e-4  # how far the squeezed skin lies inside of a roller
SPEED = 0.005  # of the body, a frame
START = 0.8  # height of its middle in frame 0
DRAWN = 0.16  # by how much a body that went through the nip is longer
SLIP = 2.0  # speed of the rollers' surface, as a part of that of the skin in the nip
FOLDED = 200  # frames until the limbs lie against the body: while the arms go through the rollers
STIR, STIR_RATE = 0.03, 0.2  # how far limbs go on to move, as a part of their fold, and radians a frame
KNOBS = 240
TRUNK = np.array([0.21, 0.26, 0.36])  # half axes: from back to belly, sideways, up


class _Limb(NamedTuple):
    direction: tuple  # x points to the belly, y sideways, z up
    reach: float  # beyond the trunk
    spread: float  # sine of the angle that its foot takes up on the trunk
    axis: tuple  # about which it folds
    angle: float  # and how far, radians


LIMBS = (
    _Limb((0.15, 0.0, 1.0), 0.24, 0.60, (0.0, 1.0, 0.0), 0.8),  # the head nods
    _Limb((0.1, 1.0, 0.5), 0.46, 0.42, (0.2, 0.0, 1.0), -2.3),  # the arms fold over the belly
    _Limb((0.1, -1.0, 0.4), 0.46, 0.42, (0.2, 0.0, 1.0), 2.3),
    _Limb((0.1, 0.75, -1.0), 0.46, 0.48, (1.0, 0.0, 0.0), -0.9),  # the legs close
    _Limb((0.1, -0.75, -1.0), 0.46, 0.48, (1.0, 0.0, 0.0), 0.9),
    _Limb((-1.0, 0.0, -0.8), 0.4, 0.42, (0.0, 1.0, 0.0), 2.1),  # the tail rolls up along the back
)


def _ramp(x):
    """0 below 0, 1 above 1, smooth between."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def _body(frequency: int, seed: int):
    """Vertices and faces at rest, and for each limb how far a vertex belongs to it (0 to 1) and its root."""
    directions, faces = icosphere(frequency)
    random = random_stream(seed)
    knobs = normalized(random.random_sample((KNOBS, 3)) - 0.5)
    height = np.zeros(len(directions))
    for knob, high in zip(knobs, 0.01 + 0.02 * random.random_sample(KNOBS), strict=True):
        away = 1.0 + 500.0 * (1.0 - dot(directions, knob))
        height = height + high / (away * away)
    trunk = directions * (TRUNK + height[:, None])
    vertices, belongs, roots = trunk.copy(), [], []
    for limb in LIMBS:
        axis = normalized(np.array(limb.direction))
        cosine = dot(directions, axis)
        # From the limb's middle (0) to the rim of its foot (1): first widens to a round tip, then runs down its side.
        t = np.where(cosine > 0.0, np.minimum(np.sqrt(np.maximum(1.0 - cosine * cosine, 0.0)) / limb.spread, 1.0), 1.0)
        root = axis * TRUNK
        out = trunk - root
        lateral = out - axis * dot(out, axis)[:, None]
        up = (1.0 - t * t) * (1.0 - t * t)
        vertices = vertices + axis * (limb.reach * up)[:, None] + lateral * (2.0 * (1.0 - t) * (1.0 - t))[:, None]
        belongs.append(_ramp(1.6 * up - 0.1))
        roots.append(root)
    return vertices, faces, belongs, roots


def _posed(vertices, belongs, roots, amount: float):
    """The body with its limbs folded by `amount`, 0 to 1."""
    for limb, part, root in zip(LIMBS, belongs, roots, strict=True):
        turn = axis_angle(normalized(np.array(limb.axis)), limb.angle * amount * part)
        vertices = root + rotate(turn, vertices - root)
    return vertices


def _squeezed(points):
    """Points of the posed body -> between the rollers, whose axes are at z = 0: none farther in x than the gap allows.

    The map is continuous and turns nothing over. Skin that was far outside comes to lie against the roller; what is
    lost in x is gained in y and z.
    """
    x, y, z = points[:, 0], points[:, 1], points[:, 2]
    z = z + DRAWN * z / np.sqrt(z * z + ROLLER * ROLLER)
    room = HALF_GAP + PRESSED + ROLLER - np.sqrt(np.maximum(ROLLER * ROLLER - z * z, 0.0))
    part = x / room
    eighth = part * part
    eighth = eighth * eighth
    eighth = eighth * eighth
    x = x / np.sqrt(np.sqrt(np.sqrt(1.0 + eighth)))
    return np.stack([x, y * (1.0 + 0.25 / (1.0 + 12.0 * z * z)), z], axis=1)


def _roller(triangles: float):
    """A pipe around y: vertices and faces, outward winding."""
    wall = ROLLER - CORE
    area = 2 * PI * (ROLLER + CORE) * (2 * HALF_WIDTH + wall)
    cell = (2 * area / triangles) ** 0.5
    along, across = max(2, round(2 * HALF_WIDTH / cell)), max(1, round(wall / cell))
    outer = np.stack([np.full(along, ROLLER), 2 * HALF_WIDTH * np.arange(along) / along - HALF_WIDTH], axis=1)
    right = np.stack([ROLLER - wall * np.arange(across) / across, np.full(across, HALF_WIDTH)], axis=1)
    inner, left = outer.copy(), right.copy()
    inner[:, 0], inner[:, 1] = CORE, -outer[:, 1]
    left[:, 0], left[:, 1] = ROLLER + CORE - right[:, 0], -HALF_WIDTH
    profile = np.concatenate([outer, right, inner, left])
    around = max(8, round(triangles / 2 / len(profile)))
    return shapes.revolved(profile[::-1], around)


def make(
    name: str, title: str, body_triangles: int, roller_triangles: int, size: float, frames: int, seed: int
) -> Scene:
    """The scene with about (body_triangles + 2 * roller_triangles) * size triangles."""
    rest, faces, belongs, roots = _body(max(4, round((body_triangles * size / 20) ** 0.5)), seed)
    roller, roller_faces = _roller(roller_triangles * size)
    y_axis, aside = np.array([0.0, 1.0, 0.0]), np.array([ROLLER + HALF_GAP, 0.0, 0.0])
    turn = SLIP * SPEED * (1.0 + DRAWN / ROLLER) / ROLLER

    def frame(index: int) -> Frame:
        height = START - SPEED * index
        fold = _ramp(np.float64(index / FOLDED)) * (1.0 + STIR * sincos(STIR_RATE * index)[0])
        body = _posed(rest, belongs, roots, float(fold))
        body = _squeezed(body + (0.0, 0.0, height))
        turned = [rotate(axis_angle(y_axis, -way * turn * index), roller) + way * aside for way in (-1.0, 1.0)]
        return Frame([body, *turned], index, index * FRAME_PERIOD)

    meshes = (
        Mesh("body", faces, len(rest)),
        Mesh("left_roller", roller_faces, len(roller), self_collision=False),
        Mesh("right_roller", roller_faces, len(roller), self_collision=False),
    )
    return Scene(name, title, meshes, frames, FRAME_PERIOD, frame)
