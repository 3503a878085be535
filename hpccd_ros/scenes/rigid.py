# SPDX-License-Identifier: Apache-2.0
"""Rigid bodies that bump into one another, each stood for by a few spheres: springs, dampers, friction.

Good enough to make piles and debris: the spheres are soft and a little smaller than the meshes, so that
the meshes overlap slightly where the bodies touch, which is what a collision detector is to report.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from hpccd_core.progress import track
from hpccd_ros.scenes.exactmath import cross, dot, length, rotate

GRAVITY = 9.81


@dataclass
class Bodies:
    """N bodies; every array but the spheres' has N rows. A body acts like a ball of its mass and radius."""

    position: np.ndarray  # (N,3) centre of mass
    velocity: np.ndarray  # (N,3)
    spin: np.ndarray  # (N,3) rad/s
    mass: np.ndarray  # (N,)
    radius: np.ndarray  # (N,) of gyration, as of a ball: inertia = 0.4 mass radius^2
    sphere_centre: np.ndarray  # (S,3) in the body's frame
    sphere_radius: np.ndarray  # (S,)
    sphere_body: np.ndarray  # (S,) body index
    release: np.ndarray | None = None  # (N,) time from which a body moves; before, it is fixed
    orientation: np.ndarray = field(init=False)  # (N,4) unit quaternions, w first

    def __post_init__(self):
        self.orientation = np.zeros((len(self.position), 4))
        self.orientation[:, 0] = 1.0
        if self.release is None:
            self.release = np.zeros(len(self.position))


@dataclass(frozen=True)
class Material:
    """Spring and damper per unit of reduced mass, so that small and large bodies stay stable alike."""

    stiffness: float = 1.5e4  # 1/s^2
    damping: float = 40.0  # 1/s
    friction: float = 0.4
    air_drag: float = 0.05  # 1/s


Ground = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]  # points (S,3) -> height above it (S,), normals (S,3)


def flat_ground(height: float) -> Ground:
    """The plane z = height."""

    def ground(points):
        normals = np.zeros_like(points)
        normals[:, 2] = 1.0
        return points[:, 2] - height, normals

    return ground


def simulate(
    bodies: Bodies,
    ground: Ground,
    frames: int,
    frame_period: float,
    material: Material,
    show_progress: bool,
    steps_per_frame: int = 24,
    description: str = "simulating bodies",
) -> dict[str, np.ndarray]:
    """Positions (frames, N, 3) and orientations (frames, N, 4) of the bodies, float64."""
    n, dt = len(bodies.position), frame_period / steps_per_frame
    positions, orientations = np.empty((frames, n, 3)), np.empty((frames, n, 4))
    positions[0], orientations[0] = bodies.position, bodies.orientation
    for frame in track(range(1, frames), description, show_progress):
        pairs = _near_pairs(bodies, frame_period)
        for step in range(steps_per_frame):
            _step(bodies, ground, pairs, material, dt, (frame - 1) * frame_period + step * dt)
        positions[frame], orientations[frame] = bodies.position, bodies.orientation
    return {"positions": positions, "orientations": orientations}


def _near_pairs(bodies: Bodies, period: float):
    """Sphere pairs of different bodies that can touch within `period` at the present speeds."""
    arm = rotate(bodies.orientation[bodies.sphere_body], bodies.sphere_centre)
    centre = bodies.position[bodies.sphere_body] + arm
    speed = length(bodies.velocity) + length(bodies.spin) * bodies.radius
    reach = bodies.sphere_radius + (1.5 * speed[bodies.sphere_body] + GRAVITY * period) * period
    rows, columns = [], []
    for start in range(0, len(centre), 256):  # blocks bound the memory of the all-pairs table
        block = slice(start, start + 256)
        gap = centre[block, None, :] - centre[None]
        near = dot(gap, gap) < (reach[block, None] + reach[None]) ** 2
        near &= bodies.sphere_body[block, None] < bodies.sphere_body[None]
        i, j = np.nonzero(near)
        rows.append(i + start)
        columns.append(j)
    return np.concatenate(rows), np.concatenate(columns)


def _scatter(total, index, values):
    """Add rows `values` to total[index], in the order of the rows."""
    for axis in range(3):
        total[:, axis] += np.bincount(index, weights=values[:, axis], minlength=len(total))


def _contact_force(gap, normal, relative, reduced_mass, material):
    """Force (K,3) on the side that `normal` points to, for overlaps `-gap` and relative velocities."""
    approach = dot(relative, normal)
    push = np.maximum(0.0, -material.stiffness * gap - material.damping * approach) * reduced_mass
    slide = relative - normal * approach[:, None]
    speed = length(slide)
    grip = np.minimum(material.friction * push, material.damping * reduced_mass * speed)
    return normal * push[:, None] - slide * (grip / np.maximum(speed, 1e-9))[:, None]


def _step(bodies: Bodies, ground: Ground, pairs, material: Material, dt: float, time: float) -> None:
    body = bodies.sphere_body
    arm = rotate(bodies.orientation[body], bodies.sphere_centre)
    centre = bodies.position[body] + arm
    velocity = bodies.velocity[body] + cross(bodies.spin[body], arm)
    force, torque = np.zeros_like(bodies.position), np.zeros_like(bodies.position)

    i, j = pairs
    gap = centre[i] - centre[j]
    distance = length(gap)
    overlap = distance - bodies.sphere_radius[i] - bodies.sphere_radius[j]
    touching = overlap < 0
    i, j, overlap = i[touching], j[touching], overlap[touching]
    normal = gap[touching] / np.maximum(distance[touching], 1e-9)[:, None]
    reduced = bodies.mass[body[i]] * bodies.mass[body[j]] / (bodies.mass[body[i]] + bodies.mass[body[j]])
    push = _contact_force(overlap, normal, velocity[i] - velocity[j], reduced, material)
    for sphere, sign in ((i, 1.0), (j, -1.0)):
        at = arm[sphere] - normal * (sign * bodies.sphere_radius[sphere])[:, None]
        _scatter(force, body[sphere], sign * push)
        _scatter(torque, body[sphere], sign * cross(at, push))

    height, normal = ground(centre)
    height = height - bodies.sphere_radius
    low = np.nonzero(height < 0)[0]
    push = _contact_force(height[low], normal[low], velocity[low], bodies.mass[body[low]], material)
    _scatter(force, body[low], push)
    _scatter(torque, body[low], cross(arm[low] - normal[low] * bodies.sphere_radius[low, None], push))

    free = (time >= bodies.release)[:, None]
    acceleration = force / bodies.mass[:, None]
    acceleration[:, 2] -= GRAVITY
    inertia = 0.4 * bodies.mass * bodies.radius * bodies.radius
    calm = 1.0 - material.air_drag * dt
    bodies.velocity = np.where(free, (bodies.velocity + acceleration * dt) * calm, bodies.velocity)
    bodies.spin = np.where(free, (bodies.spin + torque / inertia[:, None] * dt) * calm, bodies.spin)
    bodies.position = np.where(free, bodies.position + bodies.velocity * dt, bodies.position)
    bodies.orientation = np.where(free, _turn(bodies.orientation, bodies.spin * dt), bodies.orientation)


def _turn(q, rotation):
    """Quaternions `q` turned by small rotation vectors (N,3), first order and normalised."""
    w, v = q[:, :1], q[:, 1:]
    change = np.concatenate([-dot(rotation, v)[:, None], rotation * w + cross(rotation, v)], axis=1)
    q = q + 0.5 * change
    return q / np.sqrt(q[:, :1] * q[:, :1] + dot(q[:, 1:], q[:, 1:])[:, None])


def placed(points: np.ndarray, body: np.ndarray, position: np.ndarray, orientation: np.ndarray) -> np.ndarray:
    """Points (V,3) in the frames of their bodies (V,) moved to where the bodies are: (V,3) float32."""
    return (position[body] + rotate(orientation[body], points)).astype(np.float32)
