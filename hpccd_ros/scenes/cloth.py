# SPDX-License-Identifier: Apache-2.0
"""A square cloth falling on a ball that then spins: extended position-based dynamics in small steps.

One constraint sweep a step and many steps (Macklin et al. 2019, "Small steps in physics simulation"). The
cloth does not collide with itself: layers fold over and pass through one another, which is what a
collision detector is for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpccd_core.progress import track
from hpccd_ros.scenes.exactmath import random_stream, sincos

GRAVITY = 9.81


@dataclass(frozen=True)
class Setup:
    """Lengths in metres, times in seconds; the ball's centre is the origin, z points up."""

    cells: int  # cells along a side of the simulated grid
    side: float = 2.4
    ball_radius: float = 0.5
    ball_mesh_radius: float = 0.5  # a little less hides the ball's corners under a coarse cloth
    drop_height: float = 0.05  # cloth above the top of the ball in frame 0
    ground: float = -0.5  # the ball lies on it
    frame_period: float = 1 / 30
    steps_per_frame: int = 30
    friction: float = 2.0  # high: the ball takes the cloth along, and the ground holds its hem
    spin: float = 8.0  # rad/s about z, reached at spin_from + spin_ramp
    spin_from: float = 1.0
    spin_ramp: float = 0.4
    offset: tuple[float, float] = (0.06, -0.03)  # of the cloth's centre: the folds fall unevenly
    drag: float = 10.0  # 1/s; the air holds back what hangs free, so that it winds round the ball

    def ball_angle(self, time: float) -> float:
        """Angle of the ball (rad) `time` seconds after frame 0: at rest, then ramping up, then steady."""
        since = max(0.0, time - self.spin_from)
        ramp = min(since, self.spin_ramp)
        return self.spin * (0.5 * ramp * ramp / self.spin_ramp + (since - ramp))


def constraints(cells: int, spacing: float, shear: float = 2e-6, bend: float = 5e-5):
    """(slices a, slices b, rest length, compliance) such that no slice pair touches a vertex twice."""
    diagonal = spacing * 2.0**0.5
    # Offset between the two vertices in rows and columns; period along the coloured axis.
    for rows, columns, rest, compliance in (
        (0, 1, spacing, 0.0),
        (1, 0, spacing, 0.0),
        (1, 1, diagonal, shear),
        (1, -1, diagonal, shear),
        (0, 2, 2 * spacing, bend),
        (2, 0, 2 * spacing, bend),
    ):
        axis, reach = (0, rows) if rows else (1, columns)
        for colour in range(2 * reach):
            first, second = [slice(None), slice(None)], [slice(None), slice(None)]
            count = len(range(colour, cells + 1 - reach, 2 * reach))
            first[axis] = slice(colour, cells + 1 - reach, 2 * reach)
            second[axis] = slice(colour + reach, cells + 1, 2 * reach)
            if rows and columns:
                first[1], second[1] = (slice(None, -1), slice(1, None))[::columns]
            if count:
                yield (slice(None), *first), (slice(None), *second), rest, compliance


def simulate(setup: Setup, frames: int, seed: int, show_progress: bool) -> np.ndarray:
    """Vertices of the simulated grid, (frames, 3, cells + 1, cells + 1) float32."""
    n = setup.cells + 1
    grid = setup.side * (np.arange(n) / setup.cells - 0.5)
    p = np.empty((3, n, n))
    p[0] = grid[None, :] + setup.offset[0]
    p[1] = grid[:, None] + setup.offset[1]
    # Noise far below a cell: it only breaks the symmetry that would forbid the cloth to buckle.
    p[2] = setup.ball_radius + setup.drop_height + 1e-3 * random_stream(seed).random_sample((n, n))
    velocity = np.zeros_like(p)
    dt = setup.frame_period / setup.steps_per_frame
    springs = list(constraints(setup.cells, setup.side / setup.cells))
    out = np.empty((frames, 3, n, n), dtype=np.float32)
    out[0] = p
    for frame in track(range(1, frames), "simulating the cloth", show_progress):
        for step in range(setup.steps_per_frame):
            time = (frame - 1) * setup.frame_period + step * dt
            velocity *= 1.0 - setup.drag * dt
            velocity[2] -= GRAVITY * dt
            before = p.copy()
            p += velocity * dt
            for a, b, rest, compliance in springs:
                project(p[a], p[b], rest, compliance / (dt * dt))
            turn = setup.ball_angle(time + dt) - setup.ball_angle(time)
            _collide_ball(p, before, setup, turn)
            _collide_ground(p, before, setup)
            np.subtract(p, before, out=velocity)
            velocity /= dt
        out[frame] = p
    return out


def project(a, b, rest, softness):
    """One XPBD sweep of distance constraints: ends (3, ...) of unit mass, softness = compliance / dt^2."""
    d = a - b
    distance = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    d *= (distance - rest) / (distance * (2.0 + softness))
    a -= d
    b += d


def rub(slide, depth, friction):
    """Tangential correction of Coulomb friction: slide (3,N) undone up to friction * depth."""
    size = np.sqrt(slide[0] * slide[0] + slide[1] * slide[1] + slide[2] * slide[2])
    return slide * np.minimum(1.0, friction * depth / np.maximum(size, 1e-12))


def _collide_ball(p, before, setup, turn):
    radius = setup.ball_radius
    distance2 = p[0] * p[0] + p[1] * p[1] + p[2] * p[2]
    inside = distance2 < radius * radius
    if not inside.any():
        return
    q = p[:, inside]
    distance = np.sqrt(distance2[inside])
    normal = q / distance
    depth = radius - distance
    q += normal * depth
    s, c = (float(x) for x in sincos(turn))
    old = before[:, inside]
    carried = np.stack([c * old[0] - s * old[1], s * old[0] + c * old[1], old[2]])  # by the ball's own turn
    slide = q - carried
    slide -= normal * (slide[0] * normal[0] + slide[1] * normal[1] + slide[2] * normal[2])
    p[:, inside] = q - rub(slide, depth, setup.friction)


def _collide_ground(p, before, setup):
    below = p[2] < setup.ground
    if not below.any():
        return
    q = p[:, below]
    depth = setup.ground - q[2]
    q[2] = setup.ground
    slide = q - before[:, below]
    slide[2] = 0.0
    p[:, below] = q - rub(slide, depth, setup.friction)


def refine(grid: np.ndarray, cells: int) -> np.ndarray:
    """Catmull-Rom surface through a grid (3,n,n) at cells + 1 places a side: (V,3) float32, row by row.

    One motion serves all sizes of a scene: the surface and its folds are the same, the triangles finer.
    """
    for axis in (1, 2):
        grid = _refine_axis(grid, cells, axis)
    return np.ascontiguousarray(np.moveaxis(grid, 0, -1).reshape(-1, 3), dtype=np.float32)


def _refine_axis(grid, cells, axis):
    g = np.moveaxis(grid.astype(np.float64), axis, 0)
    n = len(g) - 1
    if cells == n:
        return np.moveaxis(g, 0, axis)
    g = np.concatenate([2 * g[:1] - g[1:2], g, 2 * g[-1:] - g[-2:-1]])
    place = np.arange(cells + 1) * (n / cells)
    cell = np.minimum(place.astype(np.int64), n - 1)
    t = (place - cell)[:, None, None]
    w0, w1 = ((2 - t) * t - 1) * t, (3 * t - 5) * t * t + 2
    w2, w3 = ((4 - 3 * t) * t + 1) * t, (t - 1) * t * t
    fine = 0.5 * (w0 * g[cell] + w1 * g[cell + 1] + w2 * g[cell + 2] + w3 * g[cell + 3])
    return np.moveaxis(fine, 0, axis)
