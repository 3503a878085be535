# SPDX-License-Identifier: Apache-2.0
"""A square cloth on a table, pinched by the fingers of robots/arm.py, dragged and let go.

Position-based dynamics as in cloth.py. The fingertips take the cloth under them along while they close, as rough pads
pressed on it would, so that it rises between them in a fold; from then on the fold is held too, until they open. The
cloth does not collide with itself. Only the two sides of the fold are kept on their sides, or the fingers would pull
one through the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpccd_core.progress import track
from hpccd_ros.robots import arm
from hpccd_ros.scenes.cloth import GRAVITY, constraints, project, rub
from hpccd_ros.scenes.exactmath import random_stream
from hpccd_ros.scenes.gripper import LENGTH, Gripper, Hold, in_grip, push_out, under_tips


@dataclass(frozen=True)
class Setup:
    """Lengths in metres, times in seconds; the table's top is z = 0."""

    cells: int = 50  # along a side of the simulated grid
    side: float = 0.38
    leading: float = 0.09  # from the grasp to the edge that goes ahead
    ruffled: float = 3e-4  # heights in the beginning, up to
    samples: int = 720  # of the motion that are kept, beside the first
    steps_per_sample: int = 8
    drag: float = 3.0  # 1/s, of the air
    shear: float = 2e-6  # compliances, as in cloth.py
    bend: float = 2e-6
    pressed: float = 6e-4  # height below which the table presses back
    give: float = 2e-5  # s^2: how far it gives way to an acceleration
    sunk: float = 5e-5  # no vertex is farther below its top
    friction: float = 0.25  # of the table
    finger_friction: float = 0.4
    depth: float = 1e-4  # how far cloth may be inside a finger
    apart: float = 3e-4  # of each side of the fold from the middle between the fingers
    around: float = 0.05  # so far from the grip the sides of the fold are kept apart

    @property
    def step(self) -> float:
        return arm.DURATION / (self.samples * self.steps_per_sample)


def simulate(setup: Setup, seed: int, show_progress: bool) -> np.ndarray:
    """Vertices of the simulated grid, (samples + 1, 3, cells + 1, cells + 1) float32, evenly spread over the motion."""
    p, ahead = _laid_out(setup, seed)
    velocity, dt = np.zeros_like(p), setup.step
    springs = list(constraints(setup.cells, setup.side / setup.cells, setup.shear, setup.bend))
    out = np.empty((setup.samples + 1, *p.shape), dtype=np.float32)
    out[0] = p
    gripper, holds = Gripper(0.0), []
    for sample in track(range(1, setup.samples + 1), "simulating the cloth", show_progress):
        for step in range(setup.steps_per_sample):
            time = ((sample - 1) * setup.steps_per_sample + step + 1) * dt
            velocity *= 1.0 - setup.drag * dt
            velocity[2] -= GRAVITY * dt
            before = p.copy()
            p += velocity * dt
            earlier, gripper = gripper, Gripper(time)
            holds = _holds(holds, time, before, earlier, setup)
            for a, b, rest, compliance in springs:
                project(p[a], p[b], rest, compliance / (dt * dt))
            if holds:
                _keep_sides(p, ahead, gripper, setup)
            push_out(p, before, earlier, gripper, setup.depth, setup.finger_friction)
            _collide_table(p, before, setup)
            for hold in holds:
                hold.take_along(p, gripper)
            np.subtract(p, before, out=velocity)
            velocity /= dt
        out[sample] = p
    return out


def between(grids: np.ndarray, place: float) -> np.ndarray:
    """The grid (3,n,n) at `place` on the way from sample 0 on: cubics through the samples (Catmull-Rom)."""
    last = len(grids) - 1
    at = min(int(place), last - 1)
    t = place - at
    if t == 0.0:
        return grids[at]
    a, b, c, d = (grids[k].astype(np.float64) for k in (max(at - 1, 0), at, at + 1, min(at + 2, last)))
    return 0.5 * ((((3.0 * (b - c) + d - a) * t + (2.0 * a - 5.0 * b + 4.0 * c - d)) * t + (c - a)) * t) + b


def _laid_out(setup, seed):
    """The cloth (3,n,n) where the fingers will come down, its threads along the way they close; and on which side of
    the fold a vertex will be, -1 or 1."""
    n = setup.cells + 1
    place = np.arange(n) / setup.cells
    q = np.zeros((3, n, n))
    q[0], q[1] = (setup.side * (place - 0.5))[None, :], (setup.side * (place - 1.0) + setup.leading)[:, None]
    p = Gripper(arm.CLOSING[0]).scene(q)
    # Noise far below a cell: it only breaks the symmetry that would forbid the cloth to buckle.
    p[2] = setup.ruffled * random_stream(seed).random_sample((n, n))
    return p, np.where(q[1] > 0.0, 1.0, -1.0)


def _holds(holds, time, p, gripper, setup):
    """The holders of the cloth at `time`: first the fingertips, then also the closed fingers, then nothing."""
    if not arm.CLOSING[0] <= time < arm.OPENING[0]:
        return []
    if holds and (time < arm.CLOSING[1] or len(holds) > 1):
        return holds
    by, margin = (in_grip, 5 * setup.depth) if holds else (under_tips, 0.25 * setup.side / setup.cells)
    return [*holds, Hold.of(p, by(gripper.local(p), gripper.opening, margin), gripper)]


def _keep_sides(p, ahead, gripper, setup):
    q = gripper.local(p)
    near = (np.abs(q[0]) < setup.around) & (np.abs(q[1]) < setup.around) & (q[2] < LENGTH)
    astray = near & (ahead * q[1] < setup.apart)
    q[1] = np.where(astray, ahead * setup.apart, q[1])
    p[:, astray] = gripper.scene(q[:, astray])


def _collide_table(p, before, setup):
    low = p[2] < setup.pressed
    if not low.any():
        return
    q = p[:, low]
    z = q[2] + (setup.pressed - q[2]) / (1.0 + setup.give / (setup.step * setup.step))
    z = np.maximum(z, -setup.sunk)
    depth, q[2] = z - q[2], z
    slide = q - before[:, low]
    slide[2] = 0.0
    p[:, low] = q - rub(slide, depth, setup.friction)
