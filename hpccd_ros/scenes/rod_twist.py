# SPDX-License-Identifier: Apache-2.0
"""A bundle of elastic rods, twisted between two clamps until it coils up and its layers press together.

After the twisted rods that the literature of incremental potential contact measures on; its sizes, not its data.
A closed form, no simulation. The straight bundle is carried by one smooth map of space, which cannot make
disjoint rods meet: layers stay as far apart as they are made, at every twist. The contacts are at bulges that run along
the rods, together a little higher than the gap, and neighbouring turns of the coil.
"""

from __future__ import annotations

import numpy as np

from hpccd_ros.scenes import shapes
from hpccd_ros.scenes.exactmath import PI, cross, random_stream, sincos
from hpccd_ros.scenes.scene import Frame, Mesh, Scene

FRAME_PERIOD = 1 / 60
LENGTH = 1.0  # of a rod
RODS = 9  # a chequerboard of 3 x 3
BUNDLE = LENGTH / 60  # radius of the twisted bundle
CHANNEL = BUNDLE / 1.5 / 1.1  # width of the square in the bundle that belongs to one rod
PATH = 240  # frames until the coil is tight
TURNS = 9.0  # of the twist by then; it goes on at this rate
CLAMP = 0.05  # of the length, at each end: stays straight
COIL = 0.8 * 2 * BUNDLE  # radius of the coil, at least: inside of it rods are shortened to 40 %, not turned over
LOOSE_GAP, TIGHT_GAP = 6e-4, 2e-4  # between neighbouring rods, at first and when the coil is tight
BULGE = 1.2e-4  # height: where two meet they overlap by a fifth of the gap
TURN_GAP = -4e-4  # between the outlines of neighbouring turns of the tight coil: they press into one another
SLIDE = 0.004  # how far a rod slides along its neighbours
SLIDING, RUNNING = 0.05, 1.0  # radians a frame: of the sliding, and of the bulges (half of it to either side)
NODES = 4096  # of the curve, whatever the mesh: the motion does not depend on how finely it is meshed


def _ramp(x):
    """0 below 0, 1 above 1, smooth between (two continuous derivatives)."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * x * (x * (6.0 * x - 15.0) + 10.0)


def _tight_lean(rate: float) -> float:
    """Lean of the coil whose turns are TURN_GAP apart.

    Turns of a helix are 2 pi cos(lean) / rate apart along x, and by sin(lean) nearer measured across them.
    """
    wanted = (2 * BUNDLE + TURN_GAP) * rate / (2 * PI)
    lean = PI / 2
    for _ in range(8):  # Newton's method: five steps reach the last bit
        s, c = sincos(lean)
        lean = lean + float((s * c - wanted) / (s * s - c * c))
    return lean


class _Curve:
    """Middle of the bundle: a unit-speed curve along x, whose part between the clamps coils up as `tightness` grows.

    Its tangent leaves the x axis by the angle `lean` and goes round it at a constant rate: where it leans evenly,
    that is a helix.
    """

    def __init__(self, tightness: float):
        self.rate = 1.0 / COIL
        self.lean = tightness * _tight_lean(self.rate)
        step = LENGTH / NODES
        tangents = self.frame((np.arange(NODES) + 0.5) * step)[0]
        self.points = np.zeros((NODES + 1, 3))
        self.points[1:] = np.cumsum(tangents * step, axis=0)
        self.points = self.points - self.points[NODES // 2]

    def _angles(self, along):
        rise = _ramp((along - CLAMP) / 0.14) * _ramp((LENGTH - CLAMP - along) / 0.14)
        return sincos(self.lean * rise), sincos(self.rate * (along - LENGTH / 2))

    def frame(self, along):
        """Unit tangents and normals (..., 3) at lengths `along`."""
        (sl, cl), (sp, cp) = self._angles(along)
        return np.stack([cl, sl * cp, sl * sp], axis=-1), np.stack([-sl, cl * cp, cl * sp], axis=-1)

    def at(self, along):
        """Points (..., 3) at lengths `along`: cubic between the nodes, so that edges follow the tangent."""
        place = along * (NODES / LENGTH)
        node = np.clip(np.floor(place).astype(np.int64), 0, NODES - 1)
        x = (place - node)[..., None]
        step = LENGTH / NODES
        a, b = self.points[node], self.points[node + 1]
        ta, tb = (self.frame((node + k) * step)[0] * step for k in (0, 1))
        return a + x * (ta + x * (3.0 * (b - a) - 2.0 * ta - tb + x * (ta + tb - 2.0 * (b - a))))


def _section(around: int):
    """Outline of unit width, (around, 2): a square with round corners, its sides all but flat (16-norm)."""
    quarter = around // 4
    run = (2.0 * np.arange(quarter) + 1.0) / quarter - 1.0
    one = np.ones(quarter)
    sides = [(one, run), (-run, one), (-one, -run), (run, -one)]
    points = np.concatenate([np.stack(side, axis=1) for side in sides])
    power = points
    for _ in range(4):
        power = power * power
    norm = power[:, 0] + power[:, 1]
    for _ in range(4):
        norm = np.sqrt(norm)
    return 0.5 * points / norm[:, None]


def make(name: str, title: str, triangles: int, size: float, frames: int, seed: int) -> Scene:
    """The scene with about `triangles` * size triangles; rods at the corners, at the sides and in the middle."""
    per_rod = triangles * size / RODS
    around = 4 * max(1, round(4 * size**0.5))
    rings = max(8, round((per_rod - 2 * around) / (2 * around)) + 1)
    section, faces = np.append(_section(around), [(0.0, 0.0)], axis=0), shapes.rod_faces(rings, around)
    along = LENGTH * np.arange(rings) / (rings - 1)
    random = random_stream(seed)
    waves = 24.0 + 24.0 * random.random_sample((RODS, 1))
    running = RUNNING * (random.random_sample((RODS, 1)) - 0.5)
    phase = 2 * PI * random.random_sample((RODS, 2, 1))
    row, column = np.divmod(np.arange(RODS), 3)
    centres = np.stack([row - 1.0, column - 1.0], axis=1) * CHANNEL
    kind = (row == 1).astype(int) + (column == 1)

    def frame(index: int) -> Frame:
        curve = _Curve(float(_ramp(np.float64(index / PATH))))
        # All rods at once: lengths along them (RODS, rings).
        slid = along + SLIDE * sincos(SLIDING * index + phase[:, 0])[0] * (4.0 * along * (LENGTH - along))
        gap = LOOSE_GAP + (TIGHT_GAP - LOOSE_GAP) * float(_ramp(np.float64(2.0 * index / PATH)))
        bulge = BULGE * sincos(2 * PI * waves * along - running * index + phase[:, 1])[0]
        width = CHANNEL - gap + 2.0 * bulge
        # Outlines, and with them the middles: of the first and last ring these close the ends.
        flat = centres[:, None, None, :] + width[..., None, None] * section
        # The chequerboard is pressed into a disc.
        x, y = flat[..., 0] / (1.5 * CHANNEL), flat[..., 1] / (1.5 * CHANNEL)
        u, v = BUNDLE * x * np.sqrt(1.0 - 0.5 * y * y), BUNDLE * y * np.sqrt(1.0 - 0.5 * x * x)
        # Seen from the curve's own frame the clamps must not turn with it: its turn is taken back.
        twist = 2 * PI * TURNS * index / PATH * (slid / LENGTH - 0.5) - curve.rate * (slid - LENGTH / 2)
        s, c = (value[..., None] for value in sincos(twist))
        u, v = (c * u - s * v)[..., None], (s * u + c * v)[..., None]
        tangent, normal = curve.frame(slid)
        sideways = cross(tangent, normal)
        middle = curve.at(slid)[:, :, None, :]
        tubes = middle + u * normal[:, :, None, :] + v * sideways[:, :, None, :]
        sides, ends = tubes[:, :, :around].reshape(RODS, rings * around, 3), tubes[:, [0, -1], around]
        points = np.concatenate([sides, ends], axis=1)
        return Frame([points[kind == k].reshape(-1, 3) for k in range(3)], index, index * FRAME_PERIOD)

    meshes = []
    vertices = rings * around + 2
    for k, label in enumerate(("corner_rods", "side_rods", "middle_rod")):
        count = int((kind == k).sum())
        starts = (np.arange(count, dtype=np.uint32) * np.uint32(vertices))[:, None, None]
        meshes.append(Mesh(label, (faces + starts).reshape(-1, 3), count * vertices))
    return Scene(name, title, tuple(meshes), frames, FRAME_PERIOD, frame)
