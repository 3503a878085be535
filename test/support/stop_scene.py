# SPDX-License-Identifier: Apache-2.0
"""Random approaches of a deforming ball to a deforming sheet; brute force decides which steps come within the
distance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import oracle
from numpy.typing import NDArray

from hpccd_core import shapes

MESHES = ("ball", "sheet")
FRAMES = 8  # of a trial; the last ones are far again
DISTANCE = 0.1  # stop_distance
_AWAY = 2.5  # of the centre of the ball, whose radius is 0.3, from the middle of the sheet, whose sides are 2
_BALL, _BALL_FACES = shapes.icosphere(1)
_SHEET, _SHEET_FACES = shapes.grid(4, 4)
FACES = (_BALL_FACES, _SHEET_FACES)


class Frame(NamedTuple):
    """Positions of each mesh, float32."""

    ball: NDArray[np.float32]
    sheet: NDArray[np.float32]


def trial(random: np.random.Generator) -> list[Frame]:
    """The ball comes from a random direction to a random depth, in steps of random lengths, and goes back in two."""
    azimuth, height = random.uniform(0, 2 * np.pi), random.uniform(0.4, 1.0)
    flat = np.sqrt(1 - height**2)
    direction = np.array([flat * np.cos(azimuth), flat * np.sin(azimuth), height]) * random.choice([-1, 1])
    target = np.append(random.uniform(-0.6, 0.6, 2), 0.0)
    # Some stay above, some only touch the zone, some pass through: the oracle tells which do what.
    deepest = random.choice([random.uniform(0.35, 0.6), random.uniform(0.2, 0.35), random.uniform(-1.0, 0.0)])
    parts = np.sort(random.uniform(0, 1, FRAMES - 4))
    away = [_AWAY, *(_AWAY + parts * (deepest - _AWAY)), deepest, (_AWAY + deepest) / 2, _AWAY]
    return [_frame(random, target + distance * direction) for distance in away]


def _frame(random: np.random.Generator, centre: NDArray[np.float64]) -> Frame:
    ball = centre + 0.3 * _BALL * random.uniform(0.8, 1.0, (len(_BALL), 1))
    sheet = _SHEET + random.uniform(-0.05, 0.05, _SHEET.shape)
    return Frame(ball.astype(np.float32), sheet.astype(np.float32))


def near(start: Frame, end: Frame) -> bool:
    """Whether the meshes come within the distance at some time of the step, or intersect at its end."""
    scene = {"no_self_collision": (0, 1), "threads": 1}
    v0, v1 = (np.concatenate(frame) for frame in (start, end))
    found = oracle.brute_force(v0, v1, FACES, minimum_separation=DISTANCE, **scene)
    return bool(len(found.vf) or len(found.ee) or len(oracle.intersections(v1, FACES, **scene)))
